"""Whether the vehicle stands on the ground (ArduCopter's land detector)."""

from sitl_shim.autopilot.filters import first_order_gain
from sitl_shim.autopilot.interface import TICK_RATE_HZ, TICK_S, Motion

_CLIMB_MAX_M_S = 1.0
_ACCELERATION_MAX_M_S2 = 1.0
_ACCELERATION_FILTER_HZ = 1.0
_TRIGGER_S = 1.0


class LandDetector:
    """Landed when throttle is at the bottom and nothing has moved for a second."""

    __slots__ = ("_acceleration", "_gain", "_quiet_s", "landed")

    def __init__(self, *, landed: bool) -> None:
        self.landed = landed
        self._gain = first_order_gain(TICK_RATE_HZ, _ACCELERATION_FILTER_HZ)
        self._acceleration = 0.0
        self._quiet_s = 0.0

    def leave(self) -> None:
        """The vehicle has taken off."""
        self.landed = False
        self._quiet_s = 0.0

    def step(self, motion: Motion, *, armed: bool, at_bottom: bool, rising: bool) -> None:
        """One period of 4 ms.

        Args:
            motion: the estimate.
            armed: a disarmed vehicle counts as landed.
            at_bottom: the throttle is at its lower end.
            rising: something other than a descent is asked for.
        """
        if not armed:
            self.landed = True
            self._quiet_s = 0.0
            return
        if self.landed:
            return
        ax, ay, az = motion.acceleration_enu_m_s2
        self._acceleration += self._gain * (
            (ax * ax + ay * ay + az * az) ** 0.5 - self._acceleration
        )
        quiet = (
            at_bottom
            and not rising
            and abs(motion.velocity_enu_m_s[2]) < _CLIMB_MAX_M_S
            and self._acceleration < _ACCELERATION_MAX_M_S2
        )
        self._quiet_s = self._quiet_s + TICK_S if quiet else 0.0
        self.landed = self._quiet_s >= _TRIGGER_S
