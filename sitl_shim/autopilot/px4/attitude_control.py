"""Attitude control: from an attitude setpoint to body-rate setpoints.

PX4's quaternion attitude controller (src/modules/mc_att_control/AttitudeControl), after
D. Brescianini, M. Hehn, R. D'Andrea, "Nonlinear Quadrocopter Attitude Control", ETH Zurich 2013.
"""

import math

from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Quaternion, Vector3


class AttitudeControl:
    """Proportional control of the attitude; tilt first, yaw by its weight.

    The law is the same in any pair of frames; here it is body FLU, world ENU.
    """

    __slots__ = ("_gain", "_limit", "_yaw_weight")

    def __init__(self, parameters: ParameterStore) -> None:
        self.configure(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read gains and limits anew."""
        self._yaw_weight = parameters["MC_YAW_WEIGHT"]
        yaw_gain = parameters["MC_YAW_P"]
        if self._yaw_weight > 1e-4:
            yaw_gain /= self._yaw_weight
        self._gain = (parameters["MC_ROLL_P"], parameters["MC_PITCH_P"], yaw_gain)
        self._limit = (
            math.radians(parameters["MC_ROLLRATE_MAX"]),
            math.radians(parameters["MC_PITCHRATE_MAX"]),
            math.radians(parameters["MC_YAWRATE_MAX"]),
        )

    def update(
        self, attitude: Quaternion, setpoint: Quaternion, yaw_rate_feedforward_rad_s: float
    ) -> Vector3:
        """Body rates (FLU, rad/s) that turn ``attitude`` into ``setpoint`` (FLU to ENU).

        Args:
            attitude: where the vehicle is, unit norm.
            setpoint: where it should be, of any norm but zero; NaN gives NaN rates.
            yaw_rate_feedforward_rad_s: about the world's z axis (up), added to the law's.
        """
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
            1 - 2 * (dx * dx + dy * dy),
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
            mw = min(1.0, mw)
            mz = max(-1.0, min(1.0, mz))
            weight = self._yaw_weight
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
        gx, gy, gz = self._gain
        lx, ly, lz = self._limit
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
