"""Flight control: from mode and setpoints to the rotors, one period of 4 ms at a time."""

import math
from collections.abc import Callable

from sitl_shim.autopilot.ardupilot.altitude_control import THROTTLE_FILTER_HZ, AltitudeControl
from sitl_shim.autopilot.ardupilot.attitude_control import AttitudeControl
from sitl_shim.autopilot.ardupilot.commander import Situation
from sitl_shim.autopilot.ardupilot.guided import Guided, Submode
from sitl_shim.autopilot.ardupilot.land_detector import LandDetector
from sitl_shim.autopilot.ardupilot.modes import Mode
from sitl_shim.autopilot.ardupilot.motors import Motors, Spool
from sitl_shim.autopilot.ardupilot.position_control import PositionControl
from sitl_shim.autopilot.ardupilot.rate_control import RateControl
from sitl_shim.autopilot.ardupilot.shaping import Pair, sqrt_controller
from sitl_shim.autopilot.interface import TICK_S, Motion, RotorCommands
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.position_control import attitude_from_thrust_axis, heading_of
from sitl_shim.frames import Quaternion, Vector3

_UP: Vector3 = (0.0, 0.0, 1.0)
_STILL: Pair = (0.0, 0.0)
_ARMING_DELAY_US = 2_000_000
"""Nothing takes off sooner after arming."""
_LIFTS_OFF_M_S, _LIFTS_OFF_M_S2, _LIFTS_OFF_THROTTLE = 0.05, 0.5, 0.9
_BRAKE_M_S2 = 7.5
_STICK_M_S2 = 2.5
_QUIET_CLIMB_M_S, _QUIET_TILT = 0.6, math.cos(math.radians(5.0))


class FlightControl:
    """The control cascades with what decides their setpoints.

    Args:
        parameters: gains, limits and speeds.
        guided: setpoints that came in.
        airborne: begin in the air.
    """

    def __init__(self, parameters: ParameterStore, guided: Guided, *, airborne: bool) -> None:
        self._parameters = parameters
        self._guided = guided
        self.attitude = AttitudeControl(parameters)
        self.altitude = AltitudeControl(parameters)
        self.position = PositionControl(parameters)
        self.motors = Motors(parameters, airborne=airborne)
        self._rates = RateControl(parameters)
        self.detector = LandDetector(landed=not airborne)
        self._boost = parameters["ATC_ANGLE_BOOST"] == 1.0
        self._learns = parameters["MOT_HOVER_LEARN"] > 0.0
        self._mode: Mode | None = None
        self._heading = 0.0
        self._ramp = 0.0
        self._rtl_stage = 0
        self._rtl_wait_s = 0.0
        self._goal: Vector3 = (0.0, 0.0, 0.0)
        self.throttle_asked = 0.0
        """Before angle boost: ATTITUDE_TARGET's thrust."""
        self._behaviours: dict[Mode, Callable[[Motion], None]] = {
            Mode.STABILIZE: self._stand,
            Mode.ALT_HOLD: self._sink_level,
            Mode.AUTO: self._hold_here,
            Mode.GUIDED: self._guide,
            Mode.LOITER: self._sink_in_place,
            Mode.RTL: self._return,
            Mode.LAND: self._land,
            Mode.BRAKE: self._hold_here,
            Mode.GUIDED_NOGPS: self._guide,
        }
        self._time_us = 0
        self._armed_us = 0
        self._home: Vector3 = (0.0, 0.0, 0.0)
        self.takeoff_running = False

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
        self.motors.hover = p["MOT_THST_HOVER"]

    @property
    def landed(self) -> bool:
        """The land detector's verdict."""
        return self.detector.landed

    @property
    def heading(self) -> float:
        """Where the nose is to point under position control, ENU, rad."""
        return self._heading

    @property
    def landing(self) -> bool:
        """Whether it is on its way down to the ground by a mode's decision."""
        return self._mode is Mode.LAND or (self._mode is Mode.RTL and self._rtl_stage >= 3)

    def situation(self, mode: Mode, *, armed: bool) -> Situation:
        """What the commander needs to know."""
        angle = self._guided.submode is Submode.ANGLE
        guided_by_angle = mode is Mode.GUIDED_NOGPS or (mode is Mode.GUIDED and angle and armed)
        sticks = mode in (Mode.STABILIZE, Mode.ALT_HOLD)
        return Situation(
            landed=self.detector.landed,
            idle=self.motors.spool <= Spool.IDLE,
            position_controlled=not (guided_by_angle or sticks),
            altitude_controlled=mode is not Mode.STABILIZE
            and not (guided_by_angle and self._guided.use_throttle),
        )

    # --- the run of time ---

    def arm(self, time_us: int) -> None:
        """The motors may turn from now on."""
        self._armed_us = time_us
        self._rates.reset()
        self._mode = None

    def disarm(self) -> None:
        """Stop."""
        self.motors.stop()
        self.motors.wants_unlimited = False
        self.altitude.active = self.position.active = False
        self.takeoff_running = False
        self._mode = None
        self.throttle_asked = 0.0

    def stand_by(self, motion: Motion) -> None:
        """One period disarmed."""
        self.attitude.reset(motion.attitude_flu_to_enu)
        self.detector.step(motion, armed=False, at_bottom=True, rising=False)

    def fly(self, time_us: int, motion: Motion, mode: Mode, home_enu_m: Vector3) -> RotorCommands:
        """One period armed: the rotors' signals, 0 to 1."""
        self._time_us = time_us
        self._home = home_enu_m
        if mode is not self._mode:
            self._enter(mode, motion)
        self._behaviours[mode](motion)
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
            not self.detector.landed
            and self.motors.throttle > 0.0
            and abs(motion.velocity_enu_m_s[2]) < _QUIET_CLIMB_M_S
            and 1.0 - 2.0 * (x * x + y * y) > _QUIET_TILT
            and self.altitude.active
        )

    def _enter(self, mode: Mode, motion: Motion) -> None:
        self._mode = mode
        self._heading = heading_of(self.attitude.target)
        self._ramp = 0.0
        self.takeoff_running = False
        p = self._parameters
        self.altitude.set_limits(p)
        self.position.set_limits(p["WPNAV_SPEED"] * 0.01, p["WPNAV_ACCEL"] * 0.01)
        if mode is Mode.GUIDED:
            self._guided.hold()
        elif mode is Mode.GUIDED_NOGPS:
            self._guided.level(self._level_target())
        elif mode is Mode.BRAKE:
            self.position.set_limits(10.0, _BRAKE_M_S2)
        elif mode in (Mode.LOITER, Mode.ALT_HOLD):
            up = p["PILOT_SPEED_UP"]
            self.altitude.speed_up = up * 0.01
            self.altitude.speed_down = (p["PILOT_SPEED_DN"] or up) * 0.01
            self.altitude.acceleration_max = _STICK_M_S2
        elif mode is Mode.RTL:
            x, y, z = motion.position_enu_m
            self._goal = (x, y, max(z, self._home[2] + p["RTL_ALT"] * 0.01))
            self._rtl_stage = 0
            self._rtl_wait_s = 0.0

    # --- parts of behaviours ---

    def _stand(self, motion: Motion) -> None:
        """Idle: on the ground, or with the throttle stick at the bottom in a manual mode."""
        self.motors.wants_unlimited = False
        self.motors.throttle = self.throttle_asked = 0.0
        self.attitude.reset(motion.attitude_flu_to_enu)
        self._heading = heading_of(motion.attitude_flu_to_enu)
        self.altitude.active = False
        self.position.active = False

    def _throttle(self, motion: Motion, value: float, cutoff_hz: float) -> None:
        """Give a throttle, boosted for the tilt."""
        self.throttle_asked = max(0.0, min(1.0, value))
        if self._boost:
            _, x, y, _ = motion.attitude_flu_to_enu
            up = 1.0 - 2.0 * (x * x + y * y)
            value *= max(0.0, min(1.0, 10.0 * up)) / max(0.1, min(1.0, up))
        self.motors.filter_throttle(value, cutoff_hz)

    def _control_altitude(self, motion: Motion) -> None:
        motors = self.motors
        throttle = self.altitude.update(
            motion,
            motors.hover,
            at_bottom=motors.throttle_at_bottom,
            at_top=motors.throttle_at_top,
        )
        self._throttle(motion, throttle, THROTTLE_FILTER_HZ)

    def _ensure_altitude(self, motion: Motion) -> None:
        self.motors.wants_unlimited = True
        if not self.altitude.active:
            self.altitude.start(motion, self.motors.throttle, self.motors.hover)

    def _climb(self, motion: Motion, rate_m_s: float) -> None:
        self._ensure_altitude(motion)
        motors = self.motors
        limited = 1 if motors.throttle_at_top else -1 if motors.throttle_at_bottom else 0
        error = self.altitude.position - motion.position_enu_m[2]
        self.altitude.climb(rate_m_s, limited=limited, position_error=error)
        self._control_altitude(motion)

    def _approach_height(self, motion: Motion, goal_m: float, velocity_m_s: float = 0.0) -> None:
        self._ensure_altitude(motion)
        self.altitude.approach(goal_m, velocity_m_s)
        self._control_altitude(motion)

    def _ensure_position(self, motion: Motion) -> None:
        if not self.position.active:
            self.position.start(motion, self.attitude.target)

    def _lean(self, motion: Motion) -> None:
        body_z = self.position.update(motion)
        wanted = attitude_from_thrust_axis(body_z, self._heading)
        self.attitude.follow_attitude(motion.attitude_flu_to_enu, wanted)

    def _stop_moving(self, motion: Motion) -> None:
        self._ensure_position(motion)
        self.position.follow_velocity(_STILL)
        self._lean(motion)

    def _go_to(self, motion: Motion, goal: Pair) -> None:
        self._ensure_position(motion)
        self.position.follow_position(goal)
        self._lean(motion)

    def _level_target(self) -> Quaternion:
        return attitude_from_thrust_axis(_UP, heading_of(self.attitude.target))

    # --- modes ---

    def _hold_here(self, motion: Motion) -> None:
        if self.detector.landed:
            self._stand(motion)
            return
        self._stop_moving(motion)
        self._climb(motion, 0.0)

    def _sink_level(self, motion: Motion) -> None:
        """A mode for sticks, whose throttle stick is at the bottom."""
        if self.detector.landed:
            self._stand(motion)
            return
        self.position.active = False
        wanted = attitude_from_thrust_axis(_UP, self._heading)
        self.attitude.follow_attitude(motion.attitude_flu_to_enu, wanted)
        self._climb(motion, -self.altitude.speed_down)

    def _sink_in_place(self, motion: Motion) -> None:
        if self.detector.landed:
            self._stand(motion)
            return
        self._stop_moving(motion)
        self._climb(motion, -self.altitude.speed_down)

    def _land(self, motion: Motion) -> None:
        if self.detector.landed:
            self._stand(motion)
            return
        self._stop_moving(motion)
        p = self._parameters
        low_m = max(1.0, p["LAND_ALT_LOW"] * 0.01)
        height = motion.position_enu_m[2] - self._home[2]
        slow = p["LAND_SPEED"] * 0.01
        fast = p["LAND_SPEED_HIGH"] * 0.01 or self.altitude.speed_down
        above = sqrt_controller(height - low_m, 1.0, self.altitude.acceleration_max)
        self._climb(motion, -max(slow, min(fast, above)))

    def _return(self, motion: Motion) -> None:
        if self.detector.landed:
            self._stand(motion)
            return
        x, y, z = motion.position_enu_m
        goal_x, goal_y, goal_z = self._goal
        radius_m = self._parameters["WPNAV_RADIUS"] * 0.01
        if self._rtl_stage == 0 and abs(z - goal_z) < radius_m:
            self._goal = (self._home[0], self._home[1], goal_z)
            self._rtl_stage = 1
        elif self._rtl_stage == 1 and math.hypot(x - goal_x, y - goal_y) < radius_m:
            self._rtl_stage = 2
        elif self._rtl_stage == 2:
            self._rtl_wait_s += TICK_S
            if self._rtl_wait_s >= self._parameters["RTL_LOIT_TIME"] * 0.001:
                self._rtl_stage = 3
        if self._rtl_stage == 3 and self._parameters["RTL_ALT_FINAL"] == 0.0:
            self._land(motion)
            return
        if self._rtl_stage == 3:
            goal_z = self._home[2] + self._parameters["RTL_ALT_FINAL"] * 0.01
        self._go_to(motion, (goal_x, goal_y))
        self._approach_height(motion, goal_z)

    # --- GUIDED ---

    def _guide(self, motion: Motion) -> None:
        submode = self._guided.submode
        if submode is Submode.ANGLE:
            self._guide_by_angle(motion)
            return
        if submode is Submode.TAKEOFF:
            self._take_off(motion)
            return
        if self.detector.landed:
            self._stand(motion)
            return
        guided = self._guided
        if guided.yaw_rad is not None:
            self._heading = guided.yaw_rad
        elif guided.yaw_rate_rad_s:
            self._heading += guided.yaw_rate_rad_s * TICK_S
        vx, vy, vz = guided.velocity
        ax, ay, _ = guided.acceleration
        x, y, z = guided.position
        timeout_s = self._parameters["GUID_TIMEOUT"]
        if submode is not Submode.POSITION and guided.timed_out(self._time_us, timeout_s):
            vx = vy = vz = ax = ay = 0.0
        self._ensure_position(motion)
        if submode is Submode.VELOCITY:
            self.position.follow_velocity((vx, vy), (ax, ay))
            self._lean(motion)
            self._climb(motion, vz)
            return
        self.position.follow_position((x, y), (vx, vy), (ax, ay))
        self._lean(motion)
        self._approach_height(motion, z, vz)

    def _guide_by_angle(self, motion: Motion) -> None:
        guided = self._guided
        self.position.active = False
        if guided.timed_out(self._time_us, self._parameters["GUID_TIMEOUT"]):
            guided.level(self._level_target())
        asked = guided.throttle if guided.use_throttle else guided.climb_m_s
        if self.detector.landed and asked <= 0.0:
            self._stand(motion)
            return
        if self.detector.landed:
            self._stand(motion)
            self.motors.wants_unlimited = True
            if self.motors.spool is Spool.UNLIMITED:
                self.detector.leave()
            return
        self.motors.wants_unlimited = True
        attitude = motion.attitude_flu_to_enu
        if guided.attitude is None:
            self.attitude.follow_rates(attitude, guided.rates)
        else:
            self.attitude.follow_attitude(attitude, guided.attitude, guided.rates)
            if guided.rates != (0.0, 0.0, 0.0):
                guided.attitude = _turned(guided.attitude, guided.rates)
        if guided.use_throttle:
            self.altitude.active = False
            self._throttle(motion, guided.throttle, self._parameters["PILOT_THR_FILT"])
        else:
            self._climb(motion, guided.climb_m_s)

    def _take_off(self, motion: Motion) -> None:
        motors = self.motors
        if self.detector.landed:
            self._rise_from_ground(motion)
            return
        self.takeoff_running = True
        goal_m = self._guided.takeoff_goal_m
        self._ensure_position(motion)
        self.position.follow_velocity(_STILL)
        self._lean(motion)
        self._approach_height(motion, goal_m)
        slow = abs(self.altitude.velocity) <= 0.1 * self.altitude.speed_up
        if slow and self.altitude.position >= goal_m - 0.1 and motors.throttle > 0.0:
            self.takeoff_running = False
            x, y = self.position.position
            self._guided.stay_at((x, y, goal_m))

    def _rise_from_ground(self, motion: Motion) -> None:
        """Spool up, then more and more throttle until it lifts."""
        motors = self.motors
        spooled = motors.spool is Spool.UNLIMITED
        if self._time_us - self._armed_us < _ARMING_DELAY_US or not spooled:
            delayed = self._time_us - self._armed_us < _ARMING_DELAY_US
            self._stand(motion)
            motors.wants_unlimited = not delayed
            self._ramp = 0.0
            return
        self.attitude.follow_attitude(
            motion.attitude_flu_to_enu, attitude_from_thrust_axis(_UP, self._heading)
        )
        self._ramp += TICK_S / self._parameters["TKOFF_SLEW_TIME"]
        self._throttle(motion, self._ramp, 0.0)
        self.altitude.start(motion, motors.throttle, motors.hover)
        self.position.settle(motion)
        lifts = (
            self._ramp >= _LIFTS_OFF_THROTTLE
            or motion.acceleration_enu_m_s2[2] >= _LIFTS_OFF_M_S2
            or motion.velocity_enu_m_s[2] >= _LIFTS_OFF_M_S
        )
        if lifts and self._ramp > 0.5 * motors.hover:
            self.detector.leave()


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
