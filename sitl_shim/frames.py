"""Frames and rotations of the simulated world, and their conversion at the MAVLink edge.

The simulation thinks in **ENU** (x east, y north, z up) for the world and **FLU** (x forward,
y left, z up) for the body; MAVLink speaks **NED** and **FRD**.  A quaternion is
``(w, x, y, z)``, of unit norm, and takes body vectors into the world (Hamilton product, as in
the MAVLink message ``ATTITUDE_QUATERNION``).

Yaw in ENU counts from east, counter-clockwise; a positive pitch in FLU is nose *down*.
Plain floats and tuples throughout: all of this runs at every step of the simulation.
"""

from math import asin, atan2, cos, hypot, isfinite, pi, sin, sqrt

Vector3 = tuple[float, float, float]
"""Three components; the variable's name says frame and unit."""

Quaternion = tuple[float, float, float, float]
"""(w, x, y, z), unit norm, body to world."""

_TURN = 2.0 * pi
_HALF_SQRT2 = 0.5 * sqrt(2.0)


def wrap_angle_rad(angle_rad: float) -> float:
    """The same angle within [-pi, pi)."""
    wrapped = (angle_rad + pi) % _TURN - pi
    # A tiny negative remainder is rounded up to a whole turn by the modulo.
    return wrapped if wrapped < pi else -pi


def swap_enu_ned(vector: Vector3) -> Vector3:
    """World vector from ENU to NED, or from NED to ENU: north and east change places."""
    first, second, third = vector
    return (second, first, -third)


def swap_flu_frd(vector: Vector3) -> Vector3:
    """Body vector from FLU to FRD, or from FRD to FLU: half a turn about the nose."""
    forward, side, vertical = vector
    return (forward, -side, -vertical)


def quaternion_multiply(left: Quaternion, right: Quaternion) -> Quaternion:
    """The Hamilton product; as rotations, ``right`` acts first."""
    lw, lx, ly, lz = left
    rw, rx, ry, rz = right
    return (
        lw * rw - lx * rx - ly * ry - lz * rz,
        lw * rx + rw * lx + ly * rz - lz * ry,
        lw * ry + rw * ly + lz * rx - lx * rz,
        lw * rz + rw * lz + lx * ry - ly * rx,
    )


def quaternion_conjugate(q: Quaternion) -> Quaternion:
    """The opposite rotation of a unit quaternion."""
    return (q[0], -q[1], -q[2], -q[3])


def quaternion_normalise(q: Quaternion) -> Quaternion:
    """The unit quaternion along ``q``.

    Raises:
        ValueError: ``q`` is zero or not finite, so that it says no attitude.
    """
    w, x, y, z = q
    norm = hypot(w, x, y, z)
    if not (isfinite(norm) and norm > 1e-9):
        raise ValueError(f"{q} says no attitude: its norm is {norm}")
    return (w / norm, x / norm, y / norm, z / norm)


def rotation_matrix(q: Quaternion) -> tuple[Vector3, Vector3, Vector3]:
    """Rows of the rotation matrix, body to world."""
    w, x, y, z = q
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz = x * y, x * z, y * z
    wx, wy, wz = w * x, w * y, w * z
    return (
        (1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz), 2.0 * (xz + wy)),
        (2.0 * (xy + wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx)),
        (2.0 * (xz - wy), 2.0 * (yz + wx), 1.0 - 2.0 * (xx + yy)),
    )


def rotate(q: Quaternion, vector: Vector3) -> Vector3:
    """Take a body vector into the world."""
    w, x, y, z = q
    a, b, c = vector
    # v + 2 u x (u x v + w v), with u the vector part
    s = y * c - z * b + w * a
    t = z * a - x * c + w * b
    u = x * b - y * a + w * c
    return (
        a + 2.0 * (y * u - z * t),
        b + 2.0 * (z * s - x * u),
        c + 2.0 * (x * t - y * s),
    )


def rotate_inverse(q: Quaternion, vector: Vector3) -> Vector3:
    """Take a world vector into the body."""
    return rotate((q[0], -q[1], -q[2], -q[3]), vector)


def quaternion_from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """Attitude of a yaw, then a pitch about the new y, then a roll about the new x (Z-Y-X)."""
    sin_r, cos_r = sin(0.5 * roll_rad), cos(0.5 * roll_rad)
    sin_p, cos_p = sin(0.5 * pitch_rad), cos(0.5 * pitch_rad)
    sin_y, cos_y = sin(0.5 * yaw_rad), cos(0.5 * yaw_rad)
    # yaw and pitch multiplied out first: (cp cy, -sp sy, sp cy, cp sy); then roll from the right
    w, x, y, z = cos_p * cos_y, -sin_p * sin_y, sin_p * cos_y, cos_p * sin_y
    return (
        w * cos_r - x * sin_r,
        w * sin_r + x * cos_r,
        y * cos_r + z * sin_r,
        z * cos_r - y * sin_r,
    )


def euler_from_quaternion(q: Quaternion) -> Vector3:
    """Roll, pitch, yaw in rad (Z-Y-X); undoes `quaternion_from_euler` for |pitch| < pi/2."""
    w, x, y, z = q
    sine = 2.0 * (w * y - x * z)
    return (
        atan2(2.0 * (w * x + y * z), w * w - x * x - y * y + z * z),
        asin(min(1.0, max(-1.0, sine))),
        atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z),
    )


def attitude_to_wire(flu_to_enu: Quaternion) -> Quaternion:
    """Attitude FLU to ENU as the wire has it: FRD to NED.

    With n the rotation NED to ENU, (0, 1, 1, 0)/sqrt 2, and f the half turn about the nose,
    (0, 1, 0, 0), this is n* q f, multiplied out.
    """
    w, x, y, z = flu_to_enu
    return (
        _HALF_SQRT2 * (w + z),
        _HALF_SQRT2 * (x + y),
        _HALF_SQRT2 * (x - y),
        _HALF_SQRT2 * (w - z),
    )


def attitude_from_wire(frd_to_ned: Quaternion) -> Quaternion:
    """Attitude FRD to NED, from the wire, as FLU to ENU."""
    # The map of `attitude_to_wire` is symmetric and orthogonal: its own inverse.
    return attitude_to_wire(frd_to_ned)
