"""Attitude control: from an attitude or rates asked for to body-rate setpoints.

ArduPilot's AC_AttitudeControl: a target that moves with limited acceleration towards what is
asked for, its rate fed forward, and a proportional law on what separates the vehicle from it,
tilt and heading apart.  The law is the same in any pair of frames; here body FLU, world ENU.
"""

import math

from sitl_shim.autopilot.ardupilot.shaping import shape_angle, shape_rate, sqrt_controller
from sitl_shim.autopilot.interface import TICK_S
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Quaternion, Vector3, quaternion_conjugate, quaternion_multiply, rotate

_TILT_ERROR_FULL_RAD, _TILT_ERROR_NONE_RAD = math.radians(30.0), math.radians(60.0)
"""Of the tilt error: up to the first, heading is corrected and rates are fed forward; from the
second on, not at all."""
_RP_CORRECTION_RAD_S2 = (math.radians(40.0), math.radians(720.0))
_YAW_CORRECTION_RAD_S2 = (math.radians(10.0), math.radians(120.0))
_YAW_ERROR_MAX_RAD = math.radians(45.0)


class AttitudeControl:
    """The attitude target and the law that follows it."""

    __slots__ = (
        "_acceleration",
        "_correction",
        "_gain",
        "_rate_max",
        "_shapes",
        "_time_constant_s",
        "rates",
        "target",
        "target_rate",
    )

    def __init__(self, parameters: ParameterStore) -> None:
        self.target: Quaternion = (1.0, 0.0, 0.0, 0.0)
        """FLU to ENU."""
        self.target_rate: Vector3 = (0.0, 0.0, 0.0)
        """Of the target, in its own axes, rad/s."""
        self.rates: Vector3 = (0.0, 0.0, 0.0)
        """Body-rate setpoints, FLU, rad/s."""
        self.configure(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read gains and limits anew."""
        p = parameters
        self._gain = (p["ATC_ANG_RLL_P"], p["ATC_ANG_PIT_P"], p["ATC_ANG_YAW_P"])
        centi = math.radians(0.01)
        roll, pitch, yaw = (centi * p[f"ATC_ACCEL_{axis}_MAX"] for axis in "RPY")
        self._acceleration = (roll, pitch, yaw)
        low, high = _RP_CORRECTION_RAD_S2
        yaw_low, yaw_high = _YAW_CORRECTION_RAD_S2
        self._correction = (
            max(low, min(high, 0.5 * roll)) if roll > 0.0 else 0.0,
            max(low, min(high, 0.5 * pitch)) if pitch > 0.0 else 0.0,
            max(yaw_low, min(yaw_high, 0.5 * yaw)) if yaw > 0.0 else 0.0,
        )
        roll, pitch, yaw = (math.radians(p[f"ATC_RATE_{axis}_MAX"]) for axis in "RPY")
        self._rate_max = (roll, pitch, yaw)
        self._time_constant_s = p["ATC_INPUT_TC"]
        self._shapes = p["ATC_RATE_FF_ENAB"] == 1.0

    def reset(self, attitude: Quaternion) -> None:
        """Begin where the vehicle is, at rest."""
        self.target = attitude
        self.target_rate = self.rates = (0.0, 0.0, 0.0)

    def turn(self, correction: Quaternion) -> None:
        """The estimator's heading jumped: turn the target along, so that nothing is felt.

        Args:
            correction: rotation about up that the estimate made.
        """
        self.target = quaternion_multiply(correction, self.target)

    def follow_attitude(
        self, attitude: Quaternion, wanted: Quaternion, rate: Vector3 = (0.0, 0.0, 0.0)
    ) -> None:
        """One period towards an attitude.

        Args:
            attitude: where the vehicle is, unit norm.
            wanted: where it should be, unit norm.
            rate: body rates to have there, in the axes of ``wanted``.
        """
        self._advance()
        if self._shapes:
            error = quaternion_multiply(quaternion_conjugate(self.target), wanted)
            ex, ey, ez = _rotation_vector(error)
            gx, gy, gz = rotate(error, rate) if rate != (0.0, 0.0, 0.0) else rate
            (ax, ay, az), (mx, my, mz) = self._acceleration, self._rate_max
            tc = self._time_constant_s
            rx, ry, rz = self.target_rate
            self.target_rate = (
                shape_angle(ex, tc, ax, rx, gx, mx),
                shape_angle(ey, tc, ay, ry, gy, my),
                shape_angle(ez, tc, az, rz, gz, mz),
            )
        else:
            self.target = wanted
            self.target_rate = rate
        self._correct(attitude)

    def follow_rates(self, attitude: Quaternion, rates: Vector3) -> None:
        """One period of turning at body rates (FLU, rad/s)."""
        self._advance()
        if self._shapes:
            (ax, ay, az), (rx, ry, rz) = self._acceleration, self.target_rate
            self.target_rate = (
                shape_rate(rates[0], ax, rx),
                shape_rate(rates[1], ay, ry),
                shape_rate(rates[2], az, rz),
            )
        else:
            self.target_rate = rates
        self._correct(attitude)

    def _advance(self) -> None:
        rx, ry, rz = self.target_rate
        if rx == ry == rz == 0.0:
            return
        w, x, y, z = quaternion_multiply(
            self.target, (1.0, 0.5 * TICK_S * rx, 0.5 * TICK_S * ry, 0.5 * TICK_S * rz)
        )
        scale = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
        self.target = (w * scale, x * scale, y * scale, z * scale)

    def _correct(self, attitude: Quaternion) -> None:
        """Body rates from the error between vehicle and target, and the target's own."""
        ex, ey, ez, tilt_error, rotation = _tilt_and_heading_error(attitude, self.target)
        (px, py, pz), (cx, cy, cz) = self._gain, self._correction
        ez = max(-_YAW_ERROR_MAX_RAD, min(_YAW_ERROR_MAX_RAD, ez))
        rate_x = sqrt_controller(ex, px, cx)
        rate_y = sqrt_controller(ey, py, cy)
        rate_z = sqrt_controller(ez, pz, cz)
        share = 1.0
        if tilt_error > _TILT_ERROR_FULL_RAD:
            share = max(0.0, (_TILT_ERROR_NONE_RAD - tilt_error) / _TILT_ERROR_FULL_RAD)
            rate_z *= share
        if self.target_rate != (0.0, 0.0, 0.0):
            fx, fy, fz = rotate(rotation, self.target_rate)
            rate_x, rate_y, rate_z = (
                rate_x + share * fx,
                rate_y + share * fy,
                rate_z + share * fz,
            )
        self.rates = (rate_x, rate_y, rate_z)


def _rotation_vector(q: Quaternion) -> Vector3:
    """Axis times angle, the shorter way round."""
    w, x, y, z = q
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    length = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 if length < 1e-9 else 2.0 * math.atan2(length, w) / length
    return (x * scale, y * scale, z * scale)


def _tilt_and_heading_error(
    attitude: Quaternion, target: Quaternion
) -> tuple[float, float, float, float, Quaternion]:
    """The rotation from vehicle to target: thrust axis first, then about it.

    Returns:
        Roll, pitch and yaw error in the vehicle's axes (rad), the angle between the thrust
        axes, and the whole rotation (target's axes to the vehicle's).
    """
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
    sine = math.hypot(ax, ay)
    tilt = math.atan2(sine, az)
    scale = 1.0 if sine < 1e-9 else tilt / sine
    twist = 2.0 * math.atan2(ez, ew)
    return -ay * scale, ax * scale, twist, tilt, (ew, ex, ey, ez)
