"""Between attitudes and where their axes point."""

import math

from sitl_shim.frames import Quaternion, Vector3


def attitude_from_thrust_axis(body_z: Vector3, yaw_rad: float) -> Quaternion:
    """Attitude, FLU to ENU, that points the body's z axis and heading.

    Args:
        body_z: the body's z axis in ENU, unit norm, not pointing straight down.
        yaw_rad: where the body's x axis points, seen from above (ENU).
    """
    zx, zy, zz = body_z
    # Shortest rotation from the world's z axis to body_z, after a turn by yaw about z; the yaw
    # of the product is yaw_rad to second order in the tilt, so correct it by its own error.
    norm = math.sqrt(2.0 * (1.0 + zz))
    w, x, y = norm / 2.0, -zy / norm, zx / norm
    # Heading of the tilted x axis when turned by `turn` beforehand: solve for the turn that
    # makes it yaw_rad.  x axis = R_tilt (cos t, sin t, 0); its horizontal part must be along yaw.
    r00, r01 = 1.0 - 2.0 * y * y, 2.0 * x * y
    r10, r11 = 2.0 * x * y, 1.0 - 2.0 * x * x
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    # (r00 c + r01 s) sin(yaw) = (r10 c + r11 s) cos(yaw)
    turn = math.atan2(r00 * sine - r10 * cosine, r11 * cosine - r01 * sine)
    half_c, half_s = math.cos(turn / 2.0), math.sin(turn / 2.0)
    return (w * half_c, x * half_c + y * half_s, y * half_c - x * half_s, w * half_s)


def heading_of(flu_to_enu: Quaternion) -> float:
    """Yaw (ENU, rad) of an attitude."""
    w, x, y, z = flu_to_enu
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
