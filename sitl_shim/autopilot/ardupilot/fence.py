"""ArduPilot's simple fences: a height above home, and a circle about it.

https://ardupilot.org/copter/docs/ac2_simple_geofence.html.  A fence that was broken is set up once
more, 20 m further out, and breaks there again.  Polygons and the lowest height are not looked at.
"""

import math

from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Vector3

HEIGHT, CIRCLE = 1, 2
"""Bits of FENCE_TYPE."""
_FURTHER_OUT_M = 20.0
_NAMES = ((HEIGHT, "Max Alt"), (CIRCLE, "Circle"))


class Fence:
    """Looks for breaches.

    Args:
        parameters: FENCE_*.
    """

    __slots__ = ("_limits_m", "_parameters", "beyond_m", "breached")

    def __init__(self, parameters: ParameterStore) -> None:
        self._parameters = parameters
        self._limits_m: dict[int, float] = {}
        self.breached = 0
        """Bits of the fences that are broken now."""
        self.beyond_m = 0.0
        """How far outside the vehicle is."""

    def look(self, position_enu_m: Vector3, home_enu_m: Vector3) -> int:
        """Bits of the fences that broke just now."""
        p = self._parameters
        kinds = p.integer("FENCE_TYPE") if p["FENCE_ENABLE"] else 0
        x, y, z = (own - home for own, home in zip(position_enu_m, home_enu_m, strict=True))
        new = self._look(HEIGHT, kinds, z, p["FENCE_ALT_MAX"])
        return new | self._look(CIRCLE, kinds, math.hypot(x, y), p["FENCE_RADIUS"])

    def _look(self, kind: int, kinds: int, distance_m: float, limit_m: float) -> int:
        if not kinds & kind or distance_m < limit_m:
            self.breached &= ~kind
            self._limits_m.pop(kind, None)
            return 0
        self.breached |= kind
        self.beyond_m = distance_m - limit_m
        if distance_m < self._limits_m.get(kind, limit_m):
            return 0
        self._limits_m[kind] = distance_m + _FURTHER_OUT_M
        return kind


def fence_names(kinds: int) -> str:
    """The fences, as texts name them."""
    names = [name for kind, name in _NAMES if kinds & kind]
    return " and ".join(names) + (" fences" if len(names) > 1 else " fence")
