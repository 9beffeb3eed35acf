"""The only conversions between frames and attitude representations.

Inside the companion the world is **ENU** (x east, y north, z up) and the body is **FLU**
(x forward, y left, z up), as in the paper.  On the MAVLink wire the world is **NED** and the
body is **FRD**.  Quaternions are ``(w, x, y, z)``, unit norm, Hamilton product, and rotate
vectors from the body into the world.

Sign conventions that follow: yaw is measured in ENU from east, counter-clockwise; a positive
FLU pitch is nose *down* (it accelerates the vehicle forward); a positive roll is to the right.

Everything here works on plain floats and tuples: these are called at every sample, and for
three or four numbers that is several times faster than arrays.
"""

import math

Vector3 = tuple[float, float, float]
"""Three components; the frame and the unit are in the name of the variable."""

Quaternion = tuple[float, float, float, float]
"""(w, x, y, z), unit norm, body to world."""


def wrap_angle_rad(angle_rad: float) -> float:
    """Wrap an angle into [-pi, pi)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


def swap_enu_ned(vector: Vector3) -> Vector3:
    """Convert a world vector from ENU to NED or back (the map is its own inverse)."""
    x, y, z = vector
    return (y, x, -z)


def swap_flu_frd(vector: Vector3) -> Vector3:
    """Convert a body vector from FLU to FRD or back (the map is its own inverse)."""
    x, y, z = vector
    return (x, -y, -z)


def quaternion_multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product: the rotation ``b`` first, then ``a``."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def quaternion_conjugate(q: Quaternion) -> Quaternion:
    """Inverse of a unit quaternion."""
    w, x, y, z = q
    return (w, -x, -y, -z)


def quaternion_normalise(q: Quaternion) -> Quaternion:
    """Scale to unit norm.

    Raises:
        ValueError: the norm is zero or not finite.
    """
    norm = math.sqrt(sum(c * c for c in q))
    if not math.isfinite(norm) or norm < 1e-9:
        raise ValueError(f"quaternion {q} has no direction")
    w, x, y, z = q
    return (w / norm, x / norm, y / norm, z / norm)


def rotate(q: Quaternion, vector: Vector3) -> Vector3:
    """Rotate a body vector into the world."""
    w, x, y, z = q
    vx, vy, vz = vector
    tx = 2.0 * (y * vz - z * vy)
    ty = 2.0 * (z * vx - x * vz)
    tz = 2.0 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def quaternion_from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """Quaternion of intrinsic yaw, then pitch, then roll (Z-Y-X), in one pair of frames."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def euler_from_quaternion(q: Quaternion) -> Vector3:
    """Roll, pitch, yaw (rad) of Z-Y-X, inverse of `quaternion_from_euler` for |pitch| < pi/2."""
    w, x, y, z = q
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return (roll, pitch, yaw)


_SQRT_HALF = math.sqrt(0.5)


def attitude_to_wire(flu_to_enu: Quaternion) -> Quaternion:
    """Attitude FLU → ENU as the wire wants it: FRD → NED.

    The product conj(NED → ENU) ⊗ attitude ⊗ (FLU → FRD) with NED → ENU = (0, √½, √½, 0) and
    FLU → FRD = (0, 1, 0, 0), multiplied out: it comes at every sample.
    """
    w, x, y, z = flu_to_enu
    s = _SQRT_HALF
    return (s * w + s * z, s * x + s * y, s * x - s * y, s * w - s * z)


def attitude_from_wire(frd_to_ned: Quaternion) -> Quaternion:
    """Attitude FRD → NED of the wire as FLU → ENU: the map is its own inverse."""
    w, x, y, z = frd_to_ned
    s = _SQRT_HALF
    return (s * w + s * z, s * x + s * y, s * x - s * y, s * w - s * z)


def yaw_of(q: Quaternion) -> float:
    """Yaw (rad) of an attitude, in the frames of the attitude: that of `euler_from_quaternion`."""
    w, x, y, z = q
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def tilt_cosine(q: Quaternion) -> float:
    """Cosine of the angle between the body's vertical axis and the world's."""
    _, x, y, _ = q
    return 1.0 - 2.0 * (x * x + y * y)
