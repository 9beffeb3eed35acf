"""The paper's separate proportional yaw law, as a slewed yaw setpoint.

``ψ̇ = k wrap(ψ_des - ψ)``.  An attitude setpoint carries a yaw angle, and PX4 takes a yaw rate
beside it only as feed-forward, so the law's rate (limited) moves the yaw that is commanded; ψ in
the law is that commanded yaw, which is held within reach of the measured one.
"""

from dataclasses import dataclass

from companion.frames import wrap_angle_rad


@dataclass(frozen=True, slots=True)
class YawGains:
    """Gains of the yaw law."""

    gain: float
    """k, 1/s."""
    rate_limit_rad_s: float
    lead_limit_rad: float = 0.5
    """How far the commanded yaw may run ahead of the measured one."""


def step(
    gains: YawGains, commanded_yaw_rad: float, desired_yaw_rad: float, yaw_rad: float, dt_s: float
) -> float:
    """Next commanded yaw (rad, ENU), moved by the law's rate towards the desired one."""
    error = wrap_angle_rad(desired_yaw_rad - commanded_yaw_rad)
    rate = gains.gain * error
    rate = max(-gains.rate_limit_rad_s, min(gains.rate_limit_rad_s, rate))
    moved = commanded_yaw_rad + rate * dt_s
    lead = wrap_angle_rad(moved - yaw_rad)
    lead = max(-gains.lead_limit_rad, min(gains.lead_limit_rad, lead))
    return wrap_angle_rad(yaw_rad + lead)
