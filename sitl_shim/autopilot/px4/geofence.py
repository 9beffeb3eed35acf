"""PX4's limits about home: GF_MAX_HOR_DIST, GF_MAX_VER_DIST, and what GF_ACTION does beyond them.

https://docs.px4.io/main/en/flying/geofence.html.  Of the hold, PX4 makes a place some way back
inside; here it is where the vehicle comes to rest.
"""

import math

from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.failsafe import Action, Cause
from sitl_shim.frames import Vector3

_ACTIONS = (
    Action.NONE,
    Action.WARN,
    Action.HOLD,
    Action.RETURN,
    Action.TERMINATE,
    Action.LAND,
)
"""By GF_ACTION."""


def geofence_cause(
    position_enu_m: Vector3, home_enu_m: Vector3, parameters: ParameterStore
) -> Cause | None:
    """What a place asks for; None where the limits allow it, or are off."""
    action = _ACTIONS[parameters.integer("GF_ACTION")]
    radius_m, height_m = parameters["GF_MAX_HOR_DIST"], parameters["GF_MAX_VER_DIST"]
    if action is Action.NONE or not (radius_m > 0.0 or height_m > 0.0):
        return None
    x, y, z = (own - home for own, home in zip(position_enu_m, home_enu_m, strict=True))
    too_far = radius_m > 0.0 and math.hypot(x, y) > radius_m
    too_high = height_m > 0.0 and z > height_m
    if not (too_far or too_high):
        return None
    # Who is outside must be able to fly back: a mode that is chosen ends the hold at once.
    held = action in (Action.RETURN, Action.LAND)
    return Cause("geofence", action, held=held, lasts=action is not Action.WARN)
