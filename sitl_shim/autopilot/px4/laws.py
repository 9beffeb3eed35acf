"""PX4's attitude and rate laws, as equations of floats and tuples of floats.

They run as they are, or compiled (`sitl_shim.compiled`), with the same results.
"""

import math
from typing import Final

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

AttitudeGains = tuple[float, float, float, float, float, float, float]
"""Weight of yaw; gains of roll, pitch, yaw (1/s); greatest rates (rad/s)."""

RateGains = tuple[float, float, float, float, float]
"""P, I, D, feed-forward, and the integral's limit, of one axis."""

GyroFilter = tuple[float, float, float, float, float, float, float]
"""Whether it filters (1 or 0), b0, b1, b2, a1, a2, and the gain of the derivative's filter."""

RateState = tuple[float, float, float, float, float]
"""Integral, filtered rate (rad/s), its filtered derivative (rad/s2), and the filter's memory."""

_TICK_S: Final = 0.004
_FULL_ERROR_RAD_S: Final = math.radians(400.0)
"""The integrator slows down towards this error, so that it does not wind up in a flip."""


def attitude_rates(
    gains: AttitudeGains,
    attitude: Quaternion,
    setpoint: Quaternion,
    yaw_rate_feedforward_rad_s: float,
) -> Vector3:
    """Body rates (FLU, rad/s) that turn ``attitude`` into ``setpoint`` (FLU to ENU).

    After D. Brescianini, M. Hehn, R. D'Andrea, "Nonlinear Quadrocopter Attitude Control", ETH
    Zurich 2013, as in PX4 (src/modules/mc_att_control/AttitudeControl).

    Args:
        gains: and limits.
        attitude: where the vehicle is, unit norm.
        setpoint: where it should be, of any norm but zero; NaN gives NaN rates.
        yaw_rate_feedforward_rad_s: about the world's z axis (up), added to the law's.
    """
    weight, gx, gy, gz, lx, ly, lz = gains
    w, x, y, z = attitude
    dw, dx, dy, dz = setpoint
    norm = math.sqrt(dw * dw + dx * dx + dy * dy + dz * dz)
    if not norm > 1e-9:
        return (math.nan, math.nan, math.nan)
    dw, dx, dy, dz = dw / norm, dx / norm, dy / norm, dz / norm

    # Body z axes now and as desired, and the shortest rotation from one to the other.
    zx, zy, zz = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)
    ex, ey, ez = (
        2.0 * (dx * dz + dw * dy),
        2.0 * (dy * dz - dw * dx),
        1.0 - 2.0 * (dx * dx + dy * dy),
    )
    rw = 1.0 + zx * ex + zy * ey + zz * ez
    rx, ry, rz = zy * ez - zz * ey, zz * ex - zx * ez, zx * ey - zy * ex
    norm = math.sqrt(rw * rw + rx * rx + ry * ry + rz * rz)
    if norm > 1e-6:
        rw, rx, ry, rz = rw / norm, rx / norm, ry / norm, rz / norm
        # reduced = rotation * attitude: tilt as desired, yaw as it is
        qw = rw * w - rx * x - ry * y - rz * z
        qx = rw * x + rx * w + ry * z - rz * y
        qy = rw * y - rx * z + ry * w + rz * x
        qz = rw * z + rx * y - ry * x + rz * w
        # What is left is a turn about body z; the weight takes its share of it.
        mw = qw * dw + qx * dx + qy * dy + qz * dz
        mz = qw * dz - qx * dy + qy * dx - qz * dw
        if mw < 0.0:
            mw, mz = -mw, -mz
        mw = mw if mw < 1.0 else 1.0
        mz = mz if mz < 1.0 else 1.0
        mz = mz if mz > -1.0 else -1.0
        cw, cz = math.cos(weight * math.acos(mw)), math.sin(weight * math.asin(mz))
        dw, dx, dy, dz = (
            qw * cw - qz * cz,
            qx * cw + qy * cz,
            qy * cw - qx * cz,
            qw * cz + qz * cw,
        )
    # else: upside down; then the full attitude error is the better way

    error_w = w * dw + x * dx + y * dy + z * dz
    twice = 2.0 if error_w >= 0.0 else -2.0
    rate_x = gx * twice * (w * dx - x * dw - y * dz + z * dy)
    rate_y = gy * twice * (w * dy + x * dz - y * dw - z * dx)
    rate_z = gz * twice * (w * dz - x * dy + y * dx - z * dw)
    if yaw_rate_feedforward_rad_s != 0.0:
        # World z axis seen from the body, times the rate about it.
        rate_x += 2.0 * (x * z - w * y) * yaw_rate_feedforward_rad_s
        rate_y += 2.0 * (y * z + w * x) * yaw_rate_feedforward_rad_s
        rate_z += zz * yaw_rate_feedforward_rad_s
    return (
        -lx if rate_x < -lx else lx if rate_x > lx else rate_x,
        -ly if rate_y < -ly else ly if rate_y > ly else rate_y,
        -lz if rate_z < -lz else lz if rate_z > lz else rate_z,
    )


def axis_torque(
    gains: RateGains,
    gyro: GyroFilter,
    state: RateState,
    measured: float,
    setpoint: float,
    held: bool,
    saturated: float,
) -> tuple[float, RateState]:
    """PID of one axis, with its gyro filter and its filtered derivative: torque, and next state.

    Args:
        gains: of the axis.
        gyro: the gyro's filter.
        state: of the axis.
        measured: body rate, rad/s.
        setpoint: body rate, rad/s; NaN gives no torque and leaves the integrator alone.
        held: on the ground, where nothing is to be learned.
        saturated: sign of the torque that could not be given whole last time, else 0.
    """
    p, i, d, feedforward, limit = gains
    filters, b0, b1, b2, a1, a2, d_gain = gyro
    integral, last_rate, acceleration, w1, w2 = state
    rate = measured
    if filters != 0.0:
        w0 = measured - a1 * w1 - a2 * w2
        rate = b0 * w0 + b1 * w1 + b2 * w2
        w2 = w1
        w1 = w0
    acceleration += d_gain * ((rate - last_rate) / _TICK_S - acceleration)
    error = setpoint - rate
    torque = p * error + integral - d * acceleration + feedforward * setpoint
    if torque != torque:  # NaN
        return 0.0, (integral, rate, acceleration, w1, w2)
    if held:
        integral = 0.0
    elif saturated == 0.0 or saturated * error < 0.0:
        share = error / _FULL_ERROR_RAD_S
        share = 1.0 - share * share
        if share > 0.0:
            integral = integral + share * i * error * _TICK_S
            integral = integral if integral > -limit else -limit
            integral = integral if integral < limit else limit
    torque = -1.0 if torque < -1.0 else 1.0 if torque > 1.0 else torque
    return torque, (integral, rate, acceleration, w1, w2)


def rate_torques(
    roll: RateGains,
    pitch: RateGains,
    yaw: RateGains,
    gyro: GyroFilter,
    roll_state: RateState,
    pitch_state: RateState,
    yaw_state: RateState,
    measured: Vector3,
    setpoint: Vector3,
    held: bool,
    saturated: Vector3,
) -> tuple[Vector3, RateState, RateState, RateState]:
    """`axis_torque` of all three: torques about the body axes (FLU), and the next states."""
    x, roll_next = axis_torque(roll, gyro, roll_state, measured[0], setpoint[0], held, saturated[0])
    y, pitch_next = axis_torque(
        pitch, gyro, pitch_state, measured[1], setpoint[1], held, saturated[1]
    )
    z, yaw_next = axis_torque(yaw, gyro, yaw_state, measured[2], setpoint[2], held, saturated[2])
    return (x, y, z), roll_next, pitch_next, yaw_next
