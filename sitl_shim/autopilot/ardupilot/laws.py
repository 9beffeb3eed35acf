"""ArduPilot's attitude and rate laws, as equations of floats and tuples of floats.

They run as they are, or compiled (`sitl_shim.compiled`), with the same results.  After ArduPilot's
AC_AttitudeControl, AP_Math/control and AC_PID.
"""

import math
from typing import Final

from sitl_shim.frames import (
    Quaternion,
    Vector3,
    quaternion_conjugate,
    quaternion_multiply,
    rotate,
)

_TICK_S: Final = 0.004
_TILT_ERROR_FULL_RAD: Final = math.radians(30.0)
_TILT_ERROR_NONE_RAD: Final = math.radians(60.0)
"""Of the tilt error: up to the first, heading is corrected and rates are fed forward; from the
second on, not at all."""
_YAW_ERROR_MAX_RAD: Final = math.radians(45.0)

AttitudeGains = tuple[float, float, float, float, float, float]
"""Gains of roll, pitch, yaw (1/s), and the accelerations of their corrections (rad/s2; 0: none)."""

Shape = tuple[float, float, float, float, float, float, float]
"""How targets move: greatest accelerations (rad/s2) and rates (rad/s) of roll, pitch, yaw (0: none)
and the time constant of the approach (s)."""

Target = tuple[Quaternion, Vector3, Vector3]
"""The attitude target (FLU to ENU), its rate in its own axes and the body-rate setpoints, rad/s."""

RateGains = tuple[float, float, float, float, float, float, float, float]
"""P, I, D, feed-forward, the integral's limit, and the filters of target, error and derivative."""

GyroFilter = tuple[float, float, float, float, float, float]
"""Whether it filters (1 or 0), b0, b1, b2, a1, a2."""

RateState = tuple[float, float, float, float, float, float, float]
"""Whether it has begun (1 or 0); target, error, derivative, integral; the gyro filter's memory."""


def sqrt_controller(error: float, gain: float, acceleration_max: float) -> float:
    """Rate of approach: ``gain * error``, but never faster than braking allows.

    Args:
        error: what is left.
        gain: 1/s, near the goal; 0: braking alone decides.
        acceleration_max: of the approach; 0: linear everywhere.
    """
    if acceleration_max <= 0.0:
        rate = error * gain
    elif gain == 0.0:
        rate = math.copysign(math.sqrt(2.0 * acceleration_max * abs(error)), error)
    else:
        linear = acceleration_max / (gain * gain)
        if error > linear:
            rate = math.sqrt(2.0 * acceleration_max * (error - 0.5 * linear))
        elif error < -linear:
            rate = -math.sqrt(2.0 * acceleration_max * (-error - 0.5 * linear))
        else:
            rate = error * gain
    most = abs(error) / _TICK_S  # not beyond the goal within one period
    rate = rate if rate < most else most
    return rate if rate > -most else -most


def shape_rate(wanted: float, acceleration_max: float, rate: float) -> float:
    """Next angular velocity of a target: towards ``wanted``, acceleration limited."""
    if acceleration_max <= 0.0:
        return wanted
    step = acceleration_max * _TICK_S
    most, least = rate + step, rate - step
    wanted = wanted if wanted < most else most
    return wanted if wanted > least else least


def shape_angle(
    error: float,
    time_constant_s: float,
    acceleration_max: float,
    rate: float,
    rate_goal: float,
    rate_max: float,
) -> float:
    """Next angular velocity of an attitude target on its way to the goal.

    Args:
        error: angle that is left, rad.
        time_constant_s: of the approach near the goal.
        acceleration_max: rad/s2; 0: none.
        rate: of the target now, rad/s.
        rate_goal: to have at the goal, rad/s.
        rate_max: rad/s; 0: none.
    """
    gain = 1.0 / (time_constant_s if time_constant_s > 0.01 else 0.01)
    wanted = rate_goal + sqrt_controller(error, gain, acceleration_max)
    if rate_max > 0.0:
        wanted = wanted if wanted < rate_max else rate_max
        wanted = wanted if wanted > -rate_max else -rate_max
    return shape_rate(wanted, acceleration_max, rate)


def advance(target: Quaternion, target_rate: Vector3) -> Quaternion:
    """The target a period later, at its rate."""
    rx, ry, rz = target_rate
    if rx == ry == rz == 0.0:
        return target
    w, x, y, z = quaternion_multiply(
        target, (1.0, 0.5 * _TICK_S * rx, 0.5 * _TICK_S * ry, 0.5 * _TICK_S * rz)
    )
    scale = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return (w * scale, x * scale, y * scale, z * scale)


def rotation_vector(q: Quaternion) -> Vector3:
    """Axis times angle, the shorter way round."""
    w, x, y, z = q
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    length = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 if length < 1e-9 else 2.0 * math.atan2(length, w) / length
    return (x * scale, y * scale, z * scale)


def correction(
    gains: AttitudeGains, attitude: Quaternion, target: Quaternion, target_rate: Vector3
) -> Vector3:
    """Body rates from the error between vehicle and target, and the target's own.

    The rotation from vehicle to target is taken apart: the thrust axis first, then about it.
    """
    px, py, pz, cx, cy, cz = gains
    w, x, y, z = attitude
    tw, tx, ty, tz = target
    ew = w * tw + x * tx + y * ty + z * tz
    ex = w * tx - x * tw - y * tz + z * ty
    ey = w * ty + x * tz - y * tw - z * tx
    ez = w * tz - x * ty + y * tx - z * tw
    if ew < 0.0:
        ew, ex, ey, ez = -ew, -ex, -ey, -ez
    # The target's thrust axis seen from the vehicle; swing there, then twist.
    ax, ay = 2.0 * (ex * ez + ew * ey), 2.0 * (ey * ez - ew * ex)
    az = 1.0 - 2.0 * (ex * ex + ey * ey)
    sine = math.sqrt(ax * ax + ay * ay)  # compiled and plain differ in their hypot
    tilt = math.atan2(sine, az)
    scale = 1.0 if sine < 1e-9 else tilt / sine
    twist = 2.0 * math.atan2(ez, ew)
    twist = twist if twist < _YAW_ERROR_MAX_RAD else _YAW_ERROR_MAX_RAD
    twist = twist if twist > -_YAW_ERROR_MAX_RAD else -_YAW_ERROR_MAX_RAD
    rate_x = sqrt_controller(-ay * scale, px, cx)
    rate_y = sqrt_controller(ax * scale, py, cy)
    rate_z = sqrt_controller(twist, pz, cz)
    share = 1.0
    if tilt > _TILT_ERROR_FULL_RAD:
        share = (_TILT_ERROR_NONE_RAD - tilt) / _TILT_ERROR_FULL_RAD
        share = share if share > 0.0 else 0.0
        rate_z *= share
    fx, fy, fz = target_rate
    if not fx == fy == fz == 0.0:
        fx, fy, fz = rotate((ew, ex, ey, ez), target_rate)
        rate_x, rate_y, rate_z = (
            rate_x + share * fx,
            rate_y + share * fy,
            rate_z + share * fz,
        )
    return (rate_x, rate_y, rate_z)


def follow_attitude(
    gains: AttitudeGains,
    shape: Shape,
    target: Quaternion,
    target_rate: Vector3,
    attitude: Quaternion,
    wanted: Quaternion,
    rate: Vector3,
    shapes: bool,
) -> Target:
    """One period towards an attitude.

    Args:
        gains: of the corrections.
        shape: of the target's way.
        target: as it is, and
        target_rate: as it turns.
        attitude: where the vehicle is, unit norm.
        wanted: where it should be, unit norm.
        rate: body rates to have there, in the axes of ``wanted``.
        shapes: whether the target moves by its shape; else it jumps.
    """
    target = advance(target, target_rate)
    if shapes:
        error = quaternion_multiply(quaternion_conjugate(target), wanted)
        ex, ey, ez = rotation_vector(error)
        gx, gy, gz = rate
        if not gx == gy == gz == 0.0:
            gx, gy, gz = rotate(error, rate)
        ax, ay, az, mx, my, mz, tc = shape
        rx, ry, rz = target_rate
        target_rate = (
            shape_angle(ex, tc, ax, rx, gx, mx),
            shape_angle(ey, tc, ay, ry, gy, my),
            shape_angle(ez, tc, az, rz, gz, mz),
        )
    else:
        target = wanted
        target_rate = rate
    return target, target_rate, correction(gains, attitude, target, target_rate)


def follow_rates(
    gains: AttitudeGains,
    shape: Shape,
    target: Quaternion,
    target_rate: Vector3,
    attitude: Quaternion,
    rates: Vector3,
    shapes: bool,
) -> Target:
    """One period of turning at body rates (FLU, rad/s); see `follow_attitude`."""
    target = advance(target, target_rate)
    if shapes:
        rx, ry, rz = target_rate
        target_rate = (
            shape_rate(rates[0], shape[0], rx),
            shape_rate(rates[1], shape[1], ry),
            shape_rate(rates[2], shape[2], rz),
        )
    else:
        target_rate = rates
    return target, target_rate, correction(gains, attitude, target, target_rate)


def axis_torque(
    gains: RateGains,
    gyro: GyroFilter,
    state: RateState,
    measured: float,
    setpoint: float,
    limited: bool,
) -> tuple[float, RateState]:
    """PID of one axis, with its gyro filter: torque, -1 to 1, and next state.

    Args:
        gains: of the axis.
        gyro: the gyro's filter.
        state: of the axis.
        measured: body rate, rad/s.
        setpoint: body rate, rad/s.
        limited: the motors could not give what was asked for last time.
    """
    p, i, d, feedforward, limit, filter_t, filter_e, filter_d = gains
    filters, b0, b1, b2, a1, a2 = gyro
    begun, target, error, derivative, integral, w1, w2 = state
    rate = measured
    if filters != 0.0:
        w0 = measured - a1 * w1 - a2 * w2
        rate = b0 * w0 + b1 * w1 + b2 * w2
        w2 = w1
        w1 = w0
    if begun == 0.0:
        target = setpoint
        error = setpoint - rate
        derivative = 0.0
    else:
        target += filter_t * (setpoint - target)
        last = error
        error += filter_e * (target - rate - last)
        raw = (error - last) / _TICK_S
        derivative += filter_d * (raw - derivative)
    if not limited or integral * error < 0.0:
        integral = integral + i * error * _TICK_S
        integral = -limit if integral < -limit else limit if integral > limit else integral
    torque = p * error + integral + d * derivative + feedforward * target
    torque = -1.0 if torque < -1.0 else 1.0 if torque > 1.0 else torque
    return torque, (1.0, target, error, derivative, integral, w1, w2)


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
    tilt_limited: bool,
    yaw_limited: bool,
) -> tuple[Vector3, RateState, RateState, RateState]:
    """`axis_torque` of all three: torques about the body axes (FLU), and the next states."""
    x, roll_next = axis_torque(roll, gyro, roll_state, measured[0], setpoint[0], tilt_limited)
    y, pitch_next = axis_torque(pitch, gyro, pitch_state, measured[1], setpoint[1], tilt_limited)
    z, yaw_next = axis_torque(yaw, gyro, yaw_state, measured[2], setpoint[2], yaw_limited)
    return (x, y, z), roll_next, pitch_next, yaw_next


ATTITUDE_PARTS = (
    quaternion_multiply,
    quaternion_conjugate,
    rotate,
    sqrt_controller,
    shape_rate,
    shape_angle,
    advance,
    rotation_vector,
    correction,
)
"""What the attitude laws call."""
