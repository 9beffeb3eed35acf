"""The offboard stream: what arrived, what counts as a setpoint, and whether it is alive."""

import math

from sitl_shim.autopilot.interface import AttitudeTarget, PositionSetpoint
from sitl_shim.frames import Quaternion, Vector3

_ROLL_RATE_IGNORE = 1
_PITCH_RATE_IGNORE = 2
_YAW_RATE_IGNORE = 4
_RATES_IGNORE = _ROLL_RATE_IGNORE | _PITCH_RATE_IGNORE | _YAW_RATE_IGNORE
_THRUST_IGNORE = 64
_ATTITUDE_IGNORE = 128


class OffboardStream:
    """Setpoints as SET_ATTITUDE_TARGET brings them, read by its type_mask as PX4 does.

    * Attitude is taken unless masked; a yaw rate beside it is a feed-forward.
    * Rates are taken unless roll's or pitch's is masked; then all three are dropped, but the
      stream stays alive.  With attitude not masked either, both are published: the rates hold
      until the attitude controller's next run.
    * Masked thrust is zero thrust.
    * All rates and the attitude masked is no setpoint at all.
    * Position setpoints (SET_POSITION_TARGET_*) take over from attitude, and the other way round:
      the newest decides.
    * Nothing is checked for NaN, and a quaternion may have any norm.
    """

    __slots__ = (
        "attitude",
        "attitude_controlled",
        "last_setpoint_us",
        "passing_rates",
        "position",
        "rates",
        "thrust",
        "yaw_rate_feedforward_rad_s",
    )

    def __init__(self) -> None:
        self.last_setpoint_us: int | None = None
        self.attitude_controlled = False
        """Whether the newest setpoint controls the attitude; stays when the stream stops."""
        self.position: PositionSetpoint | None = None
        """The newest setpoint, if it is one of position, velocity or acceleration."""
        self.attitude: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self.yaw_rate_feedforward_rad_s = 0.0
        self.rates: Vector3 = (0.0, 0.0, 0.0)
        self.passing_rates: Vector3 | None = None
        """Rates published beside an attitude: good for one run of the rate controller."""
        self.thrust = 0.0

    def receive(self, target: AttitudeTarget, time_us: int) -> None:
        """Take one SET_ATTITUDE_TARGET."""
        mask = target.type_mask
        has_attitude = not mask & _ATTITUDE_IGNORE
        if not has_attitude and mask & _RATES_IGNORE == _RATES_IGNORE:
            return
        self.last_setpoint_us = time_us
        self.attitude_controlled = has_attitude
        self.position = None
        has_rates = not mask & (_ROLL_RATE_IGNORE | _PITCH_RATE_IGNORE)
        thrust = 0.0 if mask & _THRUST_IGNORE else target.thrust
        if has_attitude:
            self.attitude = target.attitude_flu_to_enu
            yaw_rate = target.rate_flu_rad_s[2]
            ignored = mask & _YAW_RATE_IGNORE or not math.isfinite(yaw_rate)
            self.yaw_rate_feedforward_rad_s = 0.0 if ignored else yaw_rate
            self.thrust = thrust
        if has_rates:
            x, y, z = target.rate_flu_rad_s
            rates = (x, y, 0.0 if mask & _YAW_RATE_IGNORE else z)
            if has_attitude:
                self.passing_rates = rates
            else:
                self.rates = rates
                self.thrust = thrust

    def receive_position(self, setpoint: PositionSetpoint, time_us: int) -> None:
        """Take one position setpoint; one without any finite part is none."""
        parts = (
            *setpoint.position_enu_m,
            *setpoint.velocity_enu_m_s,
            *setpoint.acceleration_enu_m_s2,
        )
        if not any(map(math.isfinite, parts)):
            return
        self.last_setpoint_us = time_us
        self.attitude_controlled = True
        self.position = setpoint

    def alive(self, time_us: int, timeout_s: float) -> bool:
        """Whether a setpoint arrived within the time-out."""
        last = self.last_setpoint_us
        return last is not None and time_us - last < timeout_s * 1e6
