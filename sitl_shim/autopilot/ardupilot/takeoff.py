"""From the ground to a height: wait, spool up, more and more throttle, climb."""

from sitl_shim.autopilot.ardupilot.cascade import Cascade
from sitl_shim.autopilot.ardupilot.motors import Spool
from sitl_shim.autopilot.interface import TICK_S, Motion
from sitl_shim.autopilot.parameters import ParameterStore

_ARMING_DELAY_US = 2_000_000
"""Nothing takes off sooner after arming."""
_LIFTS_OFF_M_S, _LIFTS_OFF_M_S2, _LIFTS_OFF_THROTTLE = 0.05, 0.5, 0.9


class Takeoff:
    """One take-off at a time.

    Args:
        parameters: for the ramp.
        cascade: what carries it out.
    """

    __slots__ = ("_cascade", "_parameters", "_ramp", "climbing")

    def __init__(self, parameters: ParameterStore, cascade: Cascade) -> None:
        self._parameters = parameters
        self._cascade = cascade
        self._ramp = 0.0
        self.climbing = False
        """Whether it is off the ground and on its way up."""

    def reset(self) -> None:
        """None is under way."""
        self._ramp = 0.0
        self.climbing = False

    def step(self, motion: Motion, goal_m: float, armed_for_us: int) -> bool:
        """One period of a take-off; True when its height is reached.

        Args:
            motion: the estimate.
            goal_m: height in the local frame.
            armed_for_us: time since arming.
        """
        cascade = self._cascade
        if cascade.detector.landed:
            self._rise(motion, armed_for_us)
            return False
        self.climbing = True
        cascade.stop(motion)
        cascade.approach_height(motion, goal_m)
        altitude = cascade.altitude
        slow = abs(altitude.velocity) <= 0.1 * altitude.speed_up
        if slow and altitude.position >= goal_m - 0.1:
            self.reset()
            return True
        return False

    def _rise(self, motion: Motion, armed_for_us: int) -> None:
        cascade = self._cascade
        motors = cascade.motors
        if armed_for_us < _ARMING_DELAY_US or motors.spool is not Spool.UNLIMITED:
            cascade.stand(motion)
            motors.wants_unlimited = armed_for_us >= _ARMING_DELAY_US
            self._ramp = 0.0
            return
        cascade.level(motion)
        self._ramp += TICK_S / self._parameters["TKOFF_SLEW_TIME"]
        cascade.give_throttle(motion, self._ramp, 0.0)
        cascade.altitude.start(motion, motors.throttle, motors.hover)
        cascade.position.settle(motion)
        lifts = (
            self._ramp >= _LIFTS_OFF_THROTTLE
            or motion.acceleration_enu_m_s2[2] >= _LIFTS_OFF_M_S2
            or motion.velocity_enu_m_s[2] >= _LIFTS_OFF_M_S
        )
        if lifts and self._ramp > 0.5 * motors.hover:
            cascade.detector.leave()
