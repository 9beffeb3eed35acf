"""GUIDED: what the setpoints that come in ask for, and what holds when they stop."""

import math
from enum import Enum

from sitl_shim.autopilot.interface import AttitudeTarget, PositionSetpoint
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Quaternion, Vector3

_ROLL_RATE_IGNORE, _PITCH_RATE_IGNORE, _YAW_RATE_IGNORE = 1, 2, 4
_RATES_IGNORE = _ROLL_RATE_IGNORE | _PITCH_RATE_IGNORE | _YAW_RATE_IGNORE
_THRUST_IGNORE, _ATTITUDE_IGNORE = 64, 128
_UNIT_TOLERANCE = 1e-3
_HEARD_WITHIN_S = 1.0
_THRUST_IS_THROTTLE = 8
"""Bit of GUID_OPTIONS."""


class Submode(Enum):
    """What GUIDED is doing."""

    TAKEOFF = "take-off"
    VELOCITY = "velocity"
    POSITION = "position"
    TRAJECTORY = "position, velocity and acceleration"
    ANGLE = "attitude"


class Guided:
    """The target of GUIDED.

    SET_ATTITUDE_TARGET, by its type_mask: attitude and thrust (mask 7), body rates and thrust
    (128), or both (0: the rates keep turning the attitude between messages).  Thrust ignored,
    some rates ignored and others not, a quaternion that is not of unit norm within 1e-3, or a
    thrust or rate that counts and is no finite number: the message is rejected, and the vehicle is
    stopped.
    """

    __slots__ = (
        "_last_us",
        "acceleration",
        "attitude",
        "climb_m_s",
        "position",
        "rates",
        "submode",
        "takeoff_goal_m",
        "throttle",
        "use_throttle",
        "velocity",
        "yaw_rad",
        "yaw_rate_rad_s",
    )

    def __init__(self) -> None:
        self.submode = Submode.VELOCITY
        self._last_us = 0
        self.attitude: Quaternion | None = None
        """FLU to ENU; None: rates alone."""
        self.rates: Vector3 = (0.0, 0.0, 0.0)
        self.climb_m_s = 0.0
        self.throttle = 0.0
        self.use_throttle = False
        self.position: Vector3 = (0.0, 0.0, 0.0)
        self.velocity: Vector3 = (0.0, 0.0, 0.0)
        self.acceleration: Vector3 = (0.0, 0.0, 0.0)
        self.yaw_rad: float | None = None
        """Heading asked for beside a position or velocity; None: as it is."""
        self.yaw_rate_rad_s = 0.0
        self.takeoff_goal_m = 0.0

    def hold(self) -> None:
        """Stop: a velocity of zero."""
        self.submode = Submode.VELOCITY
        self.velocity = self.acceleration = (0.0, 0.0, 0.0)
        self.yaw_rad = None
        self.yaw_rate_rad_s = 0.0

    def take_off(self, goal_m: float) -> None:
        """Climb to a height in the local frame."""
        self.hold()
        self.submode = Submode.TAKEOFF
        self.takeoff_goal_m = goal_m

    def stay_at(self, position: Vector3) -> None:
        """Go to a position and stay there."""
        self.hold()
        self.submode = Submode.POSITION
        self.position = position

    def level(self, attitude: Quaternion) -> None:
        """Attitude targets take over: begin at this attitude, without climbing."""
        self.submode = Submode.ANGLE
        self.attitude = attitude
        self.rates = (0.0, 0.0, 0.0)
        self.climb_m_s = self.throttle = 0.0
        self.use_throttle = False

    def has_setpoint(self, time_us: int) -> bool:
        """Whether a client's setpoints are flown, and come in."""
        heard = self._last_us > 0 and not self.timed_out(time_us, _HEARD_WITHIN_S)
        return heard and self.submode is not Submode.TAKEOFF

    def timed_out(self, time_us: int, timeout_s: float) -> bool:
        """Whether the last target is older than GUID_TIMEOUT."""
        return time_us - self._last_us > timeout_s * 1e6

    def receive_attitude(
        self, target: AttitudeTarget, time_us: int, parameters: ParameterStore
    ) -> bool:
        """Take one SET_ATTITUDE_TARGET; False if it is rejected, which stops the vehicle."""
        mask = target.type_mask
        ignored = mask & _RATES_IGNORE
        attitude = None if mask & _ATTITUDE_IGNORE else target.attitude_flu_to_enu
        well_formed = (
            not mask & _THRUST_IGNORE
            and ignored in (0, _RATES_IGNORE)
            and math.isfinite(target.thrust)
            and (bool(ignored) or _finite(target.rate_flu_rad_s))
            and (attitude is None or abs(math.hypot(*attitude) - 1.0) <= _UNIT_TOLERANCE)
        )
        if not well_formed:
            self.hold()
            return False
        self.submode = Submode.ANGLE
        self.attitude = attitude
        self.rates = (0.0, 0.0, 0.0) if ignored else target.rate_flu_rad_s
        thrust = target.thrust
        self.use_throttle = bool(parameters.integer("GUID_OPTIONS") & _THRUST_IS_THROTTLE)
        self.throttle = max(-1.0, min(1.0, thrust)) if self.use_throttle else 0.0
        self.climb_m_s = 0.0
        if not self.use_throttle:
            share = 2.0 * (max(0.0, min(1.0, thrust)) - 0.5)
            name = "WPNAV_SPEED_UP" if share > 0.0 else "WPNAV_SPEED_DN"
            self.climb_m_s = share * parameters[name] * 0.01
        self._last_us = time_us
        return True

    def receive_position(self, setpoint: PositionSetpoint, time_us: int) -> None:
        """Take one SET_POSITION_TARGET_LOCAL_NED; what it leaves out is NaN."""
        has_position = _finite(setpoint.position_enu_m)
        has_velocity = _finite(setpoint.velocity_enu_m_s)
        has_acceleration = _finite(setpoint.acceleration_enu_m_s2)
        zero = (0.0, 0.0, 0.0)
        self.velocity = setpoint.velocity_enu_m_s if has_velocity else zero
        self.acceleration = setpoint.acceleration_enu_m_s2 if has_acceleration else zero
        if has_position:
            self.position = setpoint.position_enu_m
            self.submode = Submode.TRAJECTORY if has_velocity else Submode.POSITION
        elif has_velocity or has_acceleration:
            self.submode = Submode.VELOCITY
        else:
            self.hold()
            return
        yaw, rate = setpoint.yaw_enu_rad, setpoint.yaw_rate_rad_s
        self.yaw_rad = yaw if math.isfinite(yaw) else None
        self.yaw_rate_rad_s = rate if math.isfinite(rate) else 0.0
        self._last_us = time_us


def _finite(vector: Vector3) -> bool:
    return all(map(math.isfinite, vector))
