"""GUIDED and GUIDED_NOGPS: flies what the setpoints ask for."""

import math

from sitl_shim.autopilot.ardupilot.cascade import Cascade
from sitl_shim.autopilot.ardupilot.guided import Guided, Submode
from sitl_shim.autopilot.ardupilot.motors import Spool
from sitl_shim.autopilot.ardupilot.takeoff import Takeoff
from sitl_shim.autopilot.interface import TICK_S, Motion
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Quaternion, Vector3

_NO_RATES = (0.0, 0.0, 0.0)


class GuidedFlight:
    """Turns the target of GUIDED into movements.

    Args:
        parameters: for time-out and filter.
        guided: the target.
        cascade: what carries it out.
        takeoff: the take-off, shared with the other modes.
    """

    __slots__ = ("_cascade", "_guided", "_parameters", "_takeoff")

    def __init__(
        self, parameters: ParameterStore, guided: Guided, cascade: Cascade, takeoff: Takeoff
    ) -> None:
        self._parameters = parameters
        self._guided = guided
        self._cascade = cascade
        self._takeoff = takeoff

    def step(self, time_us: int, motion: Motion, armed_for_us: int) -> None:
        """One period of 4 ms."""
        guided, cascade = self._guided, self._cascade
        if guided.submode is Submode.ANGLE:
            self._fly_angle(time_us, motion)
        elif guided.submode is Submode.TAKEOFF:
            if self._takeoff.step(motion, guided.takeoff_goal_m, armed_for_us):
                x, y = cascade.position.position
                guided.stay_at((x, y, guided.takeoff_goal_m))
        elif cascade.detector.landed:
            cascade.stand(motion)
        else:
            self._fly_position(time_us, motion)

    # --- position, velocity, acceleration ---

    def _fly_position(self, time_us: int, motion: Motion) -> None:
        guided, cascade = self._guided, self._cascade
        if guided.yaw_rad is not None:
            cascade.heading = guided.yaw_rad
        elif guided.yaw_rate_rad_s:
            cascade.heading += guided.yaw_rate_rad_s * TICK_S
        vx, vy, vz = guided.velocity
        ax, ay, _ = guided.acceleration
        x, y, z = guided.position
        lasts = guided.submode is Submode.POSITION
        if not lasts and guided.timed_out(time_us, self._parameters["GUID_TIMEOUT"]):
            vx = vy = vz = ax = ay = 0.0
        if guided.submode is Submode.VELOCITY:
            cascade.follow_velocity(motion, (vx, vy), (ax, ay))
            cascade.climb(motion, vz)
        else:
            cascade.follow_position(motion, (x, y), (vx, vy), (ax, ay))
            cascade.approach_height(motion, z, vz)

    # --- attitude or rates, and thrust ---

    def _fly_angle(self, time_us: int, motion: Motion) -> None:
        guided, cascade = self._guided, self._cascade
        cascade.position.active = False
        if guided.timed_out(time_us, self._parameters["GUID_TIMEOUT"]):
            guided.level(cascade.level_target())
        asked = guided.throttle if guided.use_throttle else guided.climb_m_s
        if cascade.detector.landed:
            cascade.stand(motion)
            if asked > 0.0:
                cascade.motors.wants_unlimited = True
                if cascade.motors.spool is Spool.UNLIMITED:
                    cascade.detector.leave()
            return
        cascade.motors.wants_unlimited = True
        self._turn(motion)
        if guided.use_throttle:
            cascade.altitude.active = False
            cutoff_hz = self._parameters["PILOT_THR_FILT"]
            cascade.give_throttle(motion, guided.throttle, cutoff_hz)
        else:
            cascade.climb(motion, guided.climb_m_s)

    def _turn(self, motion: Motion) -> None:
        guided, control = self._guided, self._cascade.attitude
        attitude = motion.attitude_flu_to_enu
        if guided.attitude is None:
            control.follow_rates(attitude, guided.rates)
            return
        control.follow_attitude(attitude, guided.attitude, guided.rates)
        if guided.rates != _NO_RATES:
            guided.attitude = _turned(guided.attitude, guided.rates)


def _turned(attitude: Quaternion, rate: Vector3) -> Quaternion:
    """An attitude, turned on by body rates for one period."""
    w, x, y, z = attitude
    a, b, c = (0.5 * TICK_S * component for component in rate)
    w, x, y, z = (
        w - x * a - y * b - z * c,
        x + w * a + y * c - z * b,
        y + w * b + z * a - x * c,
        z + w * c + x * b - y * a,
    )
    scale = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return (w * scale, x * scale, y * scale, z * scale)
