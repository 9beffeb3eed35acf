"""The companion's own attitude loop: from an attitude setpoint to body rates.

Proportional, on the *reduced* attitude: the tilt is turned by the shortest way, and the heading by
what is left about the body's vertical axis, with a gain and a limit of its own, for a vehicle tilts
with far more torque than it yaws (Brescianini, Hehn, D'Andrea: Nonlinear quadrocopter attitude
control, ETH Zürich 2013; PX4's attitude control is of this kind).  What is seen of the attitude is
old by the delay of the loop: it is carried over it by the measured rates.

Plain floats and tuples, as in `companion.frames`.
"""

import math
from dataclasses import dataclass

from companion.frames import (
    Quaternion,
    Vector3,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_normalise,
    rotate,
)

_SMALL = 1e-9


@dataclass(frozen=True, slots=True)
class AttitudeGains:
    """Gains and limits of the loop."""

    tilt_gain_1_s: float
    """Angle of the tilt's error to rate."""
    yaw_gain_1_s: float
    """Angle of the heading's error to rate, the lower one."""
    tilt_rate_limit_rad_s: float
    """Of the vector of the rates about the body's x and y axes."""
    yaw_rate_limit_rad_s: float


def carried(attitude: Quaternion, rate_flu_rad_s: Vector3, time_s: float) -> Quaternion:
    """The attitude (body to world) after turning at constant body rates for a time."""
    x, y, z = rate_flu_rad_s
    rate = math.sqrt(x * x + y * y + z * z)
    half = 0.5 * rate * time_s
    scale = math.sin(half) / rate if rate > _SMALL else 0.5 * time_s
    turn = (math.cos(half), x * scale, y * scale, z * scale)
    return quaternion_normalise(quaternion_multiply(attitude, turn))


def body_rates(gains: AttitudeGains, attitude: Quaternion, desired: Quaternion) -> Vector3:
    """Body rates (FLU, rad/s) that turn an attitude towards a desired one.

    Args:
        gains: of the loop.
        attitude: in effect when the rates act; unit norm, FLU to ENU.
        desired: unit norm, FLU to ENU; of either sign.
    """
    # The desired attitude as seen from the body: its vertical axis is where ours must go.
    error = quaternion_multiply(quaternion_conjugate(attitude), desired)
    ux, uy, uz = rotate(error, (0.0, 0.0, 1.0))
    sine = math.hypot(ux, uy)
    tilt = math.atan2(sine, uz)
    # About the axis (-uy, ux) by that angle; upside down, any horizontal axis will do.
    ax, ay = (-uy / sine, ux / sine) if sine > _SMALL else (1.0, 0.0)
    tilt_rate = min(gains.tilt_rate_limit_rad_s, gains.tilt_gain_1_s * tilt)
    # Take the tilt out of the error: a turn about the vertical axis is left.
    half = 0.5 * tilt
    untilt = (math.cos(half), -ax * math.sin(half), -ay * math.sin(half), 0.0)
    w, _, _, z = quaternion_multiply(untilt, error)
    yaw = 2.0 * math.atan2(z, w)
    if yaw > math.pi:
        yaw -= 2.0 * math.pi
    elif yaw < -math.pi:
        yaw += 2.0 * math.pi
    limit = gains.yaw_rate_limit_rad_s
    yaw_rate = max(-limit, min(limit, gains.yaw_gain_1_s * yaw))
    return (ax * tilt_rate, ay * tilt_rate, yaw_rate)
