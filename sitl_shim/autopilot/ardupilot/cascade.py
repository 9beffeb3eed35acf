"""The control cascades of one vehicle, and the movements that flight modes are made of."""

import math

from sitl_shim.autopilot.ardupilot.altitude_control import THROTTLE_FILTER_HZ, AltitudeControl
from sitl_shim.autopilot.ardupilot.attitude_control import AttitudeControl
from sitl_shim.autopilot.ardupilot.land_detector import LandDetector
from sitl_shim.autopilot.ardupilot.motors import Motors, Spool
from sitl_shim.autopilot.ardupilot.position_control import PositionControl
from sitl_shim.autopilot.ardupilot.rate_control import RateControl
from sitl_shim.autopilot.ardupilot.shaping import Pair
from sitl_shim.autopilot.interface import EstimateStep, Motion, RotorCommands
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.thrust_axis import attitude_from_thrust_axis, heading_of
from sitl_shim.frames import Quaternion, Vector3

_UP: Vector3 = (0.0, 0.0, 1.0)
_STILL: Pair = (0.0, 0.0)
_QUIET_CLIMB_M_S, _QUIET_TILT_COSINE = 0.6, math.cos(math.radians(5.0))


class Cascade:
    """Attitude, rates, height, position, motors; who stands on the ground.

    A mode calls, once per period, movements that add up to a whole: one of the vertical ones
    and one of the horizontal ones, or `stand`.

    Args:
        parameters: gains, limits and speeds.
        airborne: begin in the air.
    """

    __slots__ = (
        "_boost",
        "_learns",
        "_parameters",
        "_rates",
        "altitude",
        "attitude",
        "detector",
        "heading",
        "motors",
        "position",
        "throttle_asked",
    )

    def __init__(self, parameters: ParameterStore, *, airborne: bool) -> None:
        self._parameters = parameters
        self.attitude = AttitudeControl(parameters)
        self.altitude = AltitudeControl(parameters)
        self.position = PositionControl(parameters)
        self.motors = Motors(parameters, airborne=airborne)
        self._rates = RateControl(parameters)
        self.detector = LandDetector(landed=not airborne)
        self.heading = 0.0
        """Where the nose is to point under position control, ENU, rad."""
        self.throttle_asked = 0.0
        """Before angle boost, 0 to 1."""
        self._boost = parameters["ATC_ANGLE_BOOST"] == 1.0
        self._learns = parameters["MOT_HOVER_LEARN"] > 0.0

    def configure(self) -> None:
        """Read the parameters anew."""
        p = self._parameters
        self.attitude.configure(p)
        self.altitude.configure(p)
        self.position.configure(p)
        self.motors.configure(p)
        self._rates.configure(p)
        self._boost = p["ATC_ANGLE_BOOST"] == 1.0
        self._learns = p["MOT_HOVER_LEARN"] > 0.0

    def reset_limits(self) -> None:
        """Speeds and accelerations of autonomous modes and GUIDED."""
        p = self._parameters
        self.altitude.set_limits(p)
        self.position.set_limits(p["WPNAV_SPEED"] * 0.01, p["WPNAV_ACCEL"] * 0.01)

    def turn(self, angle_rad: float) -> None:
        """The estimated heading jumped, about up: turn targets along, so that nothing is felt."""
        self.heading += angle_rad
        self.attitude.turn((math.cos(0.5 * angle_rad), 0.0, 0.0, math.sin(0.5 * angle_rad)))

    def note_reset(self, step: EstimateStep) -> None:
        """The estimate was set anew: targets go along, so that nothing is felt."""
        self.position.note_reset(step)
        self.altitude.note_reset(step)
        if step.yaw_rad:
            self.turn(step.yaw_rad)

    # --- the ends of a period ---

    def release(self) -> None:
        """Disarmed: stop."""
        self.motors.stop()
        self.motors.wants_unlimited = False
        self.altitude.active = self.position.active = False
        self.throttle_asked = 0.0

    def begin(self) -> None:
        """Armed: the motors may turn from now on."""
        self._rates.reset()

    def drive(self, motion: Motion) -> RotorCommands:
        """Rotor signals of this period, after the movements."""
        motors = self.motors
        motors.advance_spool()
        if motors.spool < Spool.UNLIMITED:
            self._rates.reset()
            commands = motors.idle()
        else:
            torque = self._rates.update(
                motion.rate_flu_rad_s,
                self.attitude.rates,
                (motors.tilt_limited, motors.yaw_limited),
            )
            commands = motors.mix(torque)
        self.detector.step(
            motion,
            armed=True,
            at_bottom=motors.throttle_at_bottom,
            rising=self.altitude.active and self.altitude.velocity >= 0.0,
        )
        if self._learns and self._hovers(motion):
            motors.learn_hover()
        return commands

    def _hovers(self, motion: Motion) -> bool:
        _, x, y, _ = motion.attitude_flu_to_enu
        return (
            self.altitude.active
            and not self.detector.landed
            and self.motors.throttle > 0.0
            and abs(motion.velocity_enu_m_s[2]) < _QUIET_CLIMB_M_S
            and 1.0 - 2.0 * (x * x + y * y) > _QUIET_TILT_COSINE
        )

    # --- movements ---

    def stand(self, motion: Motion) -> None:
        """Idle: on the ground, or with the throttle stick at the bottom in a manual mode."""
        self.motors.wants_unlimited = False
        self.motors.throttle = self.throttle_asked = 0.0
        self.attitude.reset(motion.attitude_flu_to_enu)
        self.heading = heading_of(motion.attitude_flu_to_enu)
        self.altitude.active = self.position.active = False

    def give_throttle(self, motion: Motion, value: float, cutoff_hz: float) -> None:
        """Give a throttle, boosted for the tilt, through the motors' filter."""
        self.throttle_asked = max(0.0, min(1.0, value))
        if self._boost:
            _, x, y, _ = motion.attitude_flu_to_enu
            up = 1.0 - 2.0 * (x * x + y * y)
            value *= max(0.0, min(1.0, 10.0 * up)) / max(0.1, min(1.0, up))
        self.motors.filter_throttle(value, cutoff_hz)

    def climb(self, motion: Motion, rate_m_s: float) -> None:
        """Vertically: at a rate."""
        self._take_height(motion)
        motors = self.motors
        limited = 1 if motors.throttle_at_top else -1 if motors.throttle_at_bottom else 0
        error = self.altitude.position - motion.position_enu_m[2]
        self.altitude.climb(rate_m_s, limited=limited, position_error=error)
        self._hold_height(motion)

    def approach_height(self, motion: Motion, goal_m: float, velocity_m_s: float = 0.0) -> None:
        """Vertically: to a height, and the velocity there."""
        self._take_height(motion)
        self.altitude.approach(goal_m, velocity_m_s)
        self._hold_height(motion)

    def stop(self, motion: Motion) -> None:
        """Horizontally: come to rest and stay."""
        self.follow_velocity(motion, _STILL, _STILL)

    def follow_velocity(self, motion: Motion, velocity: Pair, acceleration: Pair) -> None:
        """Horizontally: at a velocity, with an acceleration fed forward."""
        self._take_position(motion)
        self.position.follow_velocity(velocity, acceleration)
        self._lean(motion)

    def follow_position(
        self, motion: Motion, goal: Pair, velocity: Pair = _STILL, acceleration: Pair = _STILL
    ) -> None:
        """Horizontally: to a position and the motion there."""
        self._take_position(motion)
        self.position.follow_position(goal, velocity, acceleration)
        self._lean(motion)

    def level(self, motion: Motion) -> None:
        """Horizontally: drift, level, nose where it is to point."""
        self.position.active = False
        wanted = attitude_from_thrust_axis(_UP, self.heading)
        self.attitude.follow_attitude(motion.attitude_flu_to_enu, wanted)

    def level_target(self) -> Quaternion:
        """Level, with the heading of the attitude target."""
        return attitude_from_thrust_axis(_UP, heading_of(self.attitude.target))

    def _take_height(self, motion: Motion) -> None:
        self.motors.wants_unlimited = True
        if not self.altitude.active:
            self.altitude.start(motion, self.motors.throttle, self.motors.hover)

    def _hold_height(self, motion: Motion) -> None:
        motors = self.motors
        throttle = self.altitude.update(
            motion,
            motors.hover,
            at_bottom=motors.throttle_at_bottom,
            at_top=motors.throttle_at_top,
        )
        self.give_throttle(motion, throttle, THROTTLE_FILTER_HZ)

    def _take_position(self, motion: Motion) -> None:
        if not self.position.active:
            self.position.start(motion, self.attitude.target)

    def _lean(self, motion: Motion) -> None:
        wanted = attitude_from_thrust_axis(self.position.update(motion), self.heading)
        self.attitude.follow_attitude(motion.attitude_flu_to_enu, wanted)
