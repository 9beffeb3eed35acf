"""What is wrong with more than the mode that flies: the battery, the geofence."""

from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.battery import BatteryLevel, battery_cause, battery_level
from sitl_shim.autopilot.px4.failsafe import Cause
from sitl_shim.autopilot.px4.geofence import geofence_cause
from sitl_shim.frames import Vector3


class Watch:
    """Looks at battery and geofence.

    Args:
        parameters: of the autopilot.
    """

    __slots__ = ("_level_at_arming", "_parameters")

    def __init__(self, parameters: ParameterStore) -> None:
        self._parameters = parameters
        self._level_at_arming = BatteryLevel.NONE

    def look(
        self,
        remaining: float,
        position_enu_m: Vector3 | None,
        home_enu_m: Vector3 | None,
        *,
        armed: bool,
    ) -> tuple[Cause, ...]:
        """What is wrong now.

        Args:
            remaining: what the battery says, 0 to 1.
            position_enu_m: in flight; None where it is not known, or the vehicle stands.
            home_enu_m: None where it is not known.
            armed: while it is not, a low battery is known of.
        """
        parameters = self._parameters
        level = battery_level(remaining, parameters)
        if not armed:
            self._level_at_arming = level
        battery = fence = None
        if level is not BatteryLevel.NONE:
            battery = battery_cause(level, self._level_at_arming, parameters)
        if position_enu_m is not None and home_enu_m is not None:
            fence = geofence_cause(position_enu_m, home_enu_m, parameters)
        return tuple(cause for cause in (battery, fence) if cause is not None)
