"""The plant's equations: rotors, and Newton's and Euler's of a rigid body with drag.

Plain functions of floats and tuples of floats, so that they run as they are, and compiled
(`sitl_shim.compiled`), with the same results.

State: velocity (world), attitude quaternion (body to world), body rate.  Position appears on
no right-hand side, because the wind is held over a step, so it is integrated in closed form
from the same stages.
"""

from math import sqrt

Vector3 = tuple[float, float, float]
Four = tuple[float, float, float, float]

Wrench = tuple[float, float, float, float]
"""Thrust along the body's z (N), and torque about its x, y, z (N m), FLU."""

Motion = tuple[float, float, float, float, float, float, float, float, float, float]
"""Velocity ENU (m/s), attitude (w, x, y, z) FLU to ENU, rate FLU (rad/s)."""

MotionRate = Motion
"""Time derivative of a `Motion`."""

Body = tuple[
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
    float,
]
"""1 / mass; moments of inertia (x, y, z); linear drag per mass (x, y, z) and quadratic drag per
mass; damping of the rates (x, y, z); gravity.  SI units, FLU."""

Lag = tuple[float, float]
"""What is left of a rotor's distance to its target after half a step and after a whole one."""

ThrustMap = tuple[float, float, float, float, float, float, float, float]
"""Linear part of the four rotors, then square part, N."""

Arms = tuple[float, float, float, float, float, float, float, float, float, float, float, float]
"""Of the four rotors: x (m), then y (m), then torque about z per thrust (m)."""


Cells = tuple[float, float, float, float, float, float]
"""Of a battery: power of the avionics and of all motors at full command (W), voltage when empty and
when full (V), resistance (ohm), capacity (A s)."""


def lag_signals(lag: Lag, signals: Four, targets: Four) -> tuple[Four, Four]:
    """Signals after half a step and after a whole one, for targets held over it: exact."""
    half, whole = lag
    a, b, c, d = targets
    da, db, dc, dd = signals[0] - a, signals[1] - b, signals[2] - c, signals[3] - d
    return (
        (a + half * da, b + half * db, c + half * dc, d + half * dd),
        (a + whole * da, b + whole * db, c + whole * dc, d + whole * dd),
    )


def thrusts_of(thrust_map: ThrustMap, signals: Four) -> Four:
    """Thrust of each rotor, N."""
    l1, l2, l3, l4, s1, s2, s3, s4 = thrust_map
    a, b, c, d = signals
    return (
        (l1 + s1 * a) * a,
        (l2 + s2 * b) * b,
        (l3 + s3 * c) * c,
        (l4 + s4 * d) * d,
    )


def wrench_of(arms: Arms, thrusts: Four) -> Wrench:
    """Sum of the rotors' thrusts, of their moments and of their reaction torques."""
    x1, x2, x3, x4, y1, y2, y3, y4, k1, k2, k3, k4 = arms
    a, b, c, d = thrusts
    return (
        a + b + c + d,
        y1 * a + y2 * b + y3 * c + y4 * d,
        -(x1 * a + x2 * b + x3 * c + x4 * d),
        k1 * a + k2 * b + k3 * c + k4 * d,
    )


def drive(
    lag: Lag, thrust_map: ThrustMap, arms: Arms, signals: Four, targets: Four
) -> tuple[Four, Four, Wrench]:
    """The rotors after one step: signals, thrusts and what they do to the body."""
    _, end = lag_signals(lag, signals, targets)
    thrusts = thrusts_of(thrust_map, end)
    return end, thrusts, wrench_of(arms, thrusts)


def discharge(
    cells: Cells, remaining: float, voltage_v: float, signals: Four, step_s: float
) -> tuple[float, float]:
    """What remains of a battery's charge after a step (share), and its voltage.

    Shaft power goes with the cube of a rotor's speed, and the signal stands for the speed.
    """
    idle_w, full_w, empty_v, full_v, resistance_ohm, capacity_a_s = cells
    a, b, c, d = signals
    power_w = idle_w + 0.25 * full_w * (a * a * a + b * b * b + c * c * c + d * d * d)
    current_a = power_w / voltage_v
    left = remaining - current_a * step_s / capacity_a_s
    remaining = left if left > 0.0 else 0.0
    open_v = empty_v + remaining * (full_v - empty_v)
    # Never below half: the current above is a power over a voltage.
    under_load_v, least_v = open_v - current_a * resistance_ohm, 0.5 * empty_v
    return remaining, (least_v if least_v > under_load_v else under_load_v)


def derivative(body: Body, motion: Motion, wrench: Wrench, wind: Vector3) -> MotionRate:
    """The equations of motion, in a wind (ENU, m/s).

    Linear drag acts along each body axis (the rotors'), quadratic drag along the relative
    velocity (the frame's); both on velocity relative to the air.
    """
    per_mass, ix, iy, iz, dx, dy, dz, quadratic, ax_damp, ay_damp, az_damp, gravity = body
    vx, vy, vz, w, x, y, z, p, q, r = motion
    thrust, tx, ty, tz = wrench
    ux, uy, uz = vx - wind[0], vy - wind[1], vz - wind[2]
    x2, y2, z2 = x + x, y + y, z + z
    xx, yy, zz = x * x2, y * y2, z * z2
    xy, xz, yz = x * y2, x * z2, y * z2
    wx, wy, wz = w * x2, w * y2, w * z2
    m00, m01, m02 = 1.0 - yy - zz, xy - wz, xz + wy
    m10, m11, m12 = xy + wz, 1.0 - xx - zz, yz - wx
    m20, m21, m22 = xz - wy, yz + wx, 1.0 - xx - yy
    bx = -dx * (m00 * ux + m10 * uy + m20 * uz)
    by = -dy * (m01 * ux + m11 * uy + m21 * uz)
    bz = thrust * per_mass - dz * (m02 * ux + m12 * uy + m22 * uz)
    drag = quadratic * sqrt(ux * ux + uy * uy + uz * uz)
    return (
        m00 * bx + m01 * by + m02 * bz - drag * ux,
        m10 * bx + m11 * by + m12 * bz - drag * uy,
        m20 * bx + m21 * by + m22 * bz - drag * uz - gravity,
        -0.5 * (x * p + y * q + z * r),
        0.5 * (w * p + y * r - z * q),
        0.5 * (w * q + z * p - x * r),
        0.5 * (w * r + x * q - y * p),
        (tx + (iy - iz) * q * r - ax_damp * p) / ix,
        (ty + (iz - ix) * r * p - ay_damp * q) / iy,
        (tz + (ix - iy) * p * q - az_damp * r) / iz,
    )


def drag_acceleration(
    body: Body, w: float, x: float, y: float, z: float, ux: float, uy: float, uz: float
) -> Vector3:
    """Drag per mass (m/s2, ENU) of an attitude and a velocity relative to the air (ENU)."""
    _, _, _, _, dx, dy, dz, quadratic, _, _, _, _ = body
    frame = quadratic * sqrt(ux * ux + uy * uy + uz * uz)
    if dx == dy == dz:
        total = -(dx + frame)
        return (total * ux, total * uy, total * uz)
    x2, y2, z2 = x + x, y + y, z + z
    m00, m01, m02 = 1.0 - y * y2 - z * z2, x * y2 - w * z2, x * z2 + w * y2
    m10, m11, m12 = x * y2 + w * z2, 1.0 - x * x2 - z * z2, y * z2 - w * x2
    m20, m21, m22 = x * z2 - w * y2, y * z2 + w * x2, 1.0 - x * x2 - y * y2
    bx = dx * (m00 * ux + m10 * uy + m20 * uz)
    by = dy * (m01 * ux + m11 * uy + m21 * uz)
    bz = dz * (m02 * ux + m12 * uy + m22 * uz)
    return (
        -(m00 * bx + m01 * by + m02 * bz) - frame * ux,
        -(m10 * bx + m11 * by + m12 * bz) - frame * uy,
        -(m20 * bx + m21 * by + m22 * bz) - frame * uz,
    )


def runge_kutta_step(
    body: Body,
    motion: Motion,
    first: MotionRate,
    wrench_mid: Wrench,
    wrench_end: Wrench,
    wind: Vector3,
    step_s: float,
) -> tuple[Vector3, Motion]:
    """One step of the classical fourth-order Runge-Kutta method.

    Args:
        body: that moves.
        motion: at the start.
        first: the derivative there (the caller has it from the end of the step before).
        wrench_mid: of the rotors, half a step on.
        wrench_end: of the rotors, a whole step on.
        wind: ENU, m/s; held.
        step_s: the step.

    Returns:
        The displacement (ENU, m) and the motion at the end, its quaternion of unit norm.
    """
    half = 0.5 * step_s
    v0, v1, v2, q0, q1, q2, q3, w0, w1, w2 = motion
    a0, a1, a2, a3, a4, a5, a6, a7, a8, a9 = first
    second = derivative(
        body,
        (
            v0 + half * a0,
            v1 + half * a1,
            v2 + half * a2,
            q0 + half * a3,
            q1 + half * a4,
            q2 + half * a5,
            q3 + half * a6,
            w0 + half * a7,
            w1 + half * a8,
            w2 + half * a9,
        ),
        wrench_mid,
        wind,
    )
    b0, b1, b2, b3, b4, b5, b6, b7, b8, b9 = second
    third = derivative(
        body,
        (
            v0 + half * b0,
            v1 + half * b1,
            v2 + half * b2,
            q0 + half * b3,
            q1 + half * b4,
            q2 + half * b5,
            q3 + half * b6,
            w0 + half * b7,
            w1 + half * b8,
            w2 + half * b9,
        ),
        wrench_mid,
        wind,
    )
    c0, c1, c2, c3, c4, c5, c6, c7, c8, c9 = third
    fourth = derivative(
        body,
        (
            v0 + step_s * c0,
            v1 + step_s * c1,
            v2 + step_s * c2,
            q0 + step_s * c3,
            q1 + step_s * c4,
            q2 + step_s * c5,
            q3 + step_s * c6,
            w0 + step_s * c7,
            w1 + step_s * c8,
            w2 + step_s * c9,
        ),
        wrench_end,
        wind,
    )
    d0, d1, d2, d3, d4, d5, d6, d7, d8, d9 = fourth
    sixth = step_s / 6.0
    q0 += sixth * (a3 + 2.0 * (b3 + c3) + d3)
    q1 += sixth * (a4 + 2.0 * (b4 + c4) + d4)
    q2 += sixth * (a5 + 2.0 * (b5 + c5) + d5)
    q3 += sixth * (a6 + 2.0 * (b6 + c6) + d6)
    norm = sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    # h v + h^2/6 (a + b + c) is what the same method gives for the position.
    reach = step_s * sixth
    return (
        (
            step_s * v0 + reach * (a0 + b0 + c0),
            step_s * v1 + reach * (a1 + b1 + c1),
            step_s * v2 + reach * (a2 + b2 + c2),
        ),
        (
            v0 + sixth * (a0 + 2.0 * (b0 + c0) + d0),
            v1 + sixth * (a1 + 2.0 * (b1 + c1) + d1),
            v2 + sixth * (a2 + 2.0 * (b2 + c2) + d2),
            q0 / norm,
            q1 / norm,
            q2 / norm,
            q3 / norm,
            w0 + sixth * (a7 + 2.0 * (b7 + c7) + d7),
            w1 + sixth * (a8 + 2.0 * (b8 + c8) + d8),
            w2 + sixth * (a9 + 2.0 * (b9 + c9) + d9),
        ),
    )


def fly(
    body: Body,
    lag: Lag,
    thrust_map: ThrustMap,
    arms: Arms,
    signals: Four,
    targets: Four,
    motion: Motion,
    slope: MotionRate,
    wind: Vector3,
    step_s: float,
    cells: Cells,
    remaining: float,
    voltage_v: float,
) -> tuple[Four, Four, Wrench, Vector3, Motion, tuple[MotionRate, Vector3], tuple[float, float]]:
    """One step in free air, the rotors' targets and the wind held.

    Returns:
        The rotors' signals, thrusts and wrench at the end, the displacement (ENU, m) and the
        motion at the end; what `observe` says of it in the same wind, and `discharge` of the
        battery.
    """
    mid, end = lag_signals(lag, signals, targets)
    thrusts = thrusts_of(thrust_map, end)
    wrench = wrench_of(arms, thrusts)
    wrench_mid = wrench_of(arms, thrusts_of(thrust_map, mid))
    reach, after = runge_kutta_step(body, motion, slope, wrench_mid, wrench, wind, step_s)
    seen = observe(body, after, wrench, wind)
    left = discharge(cells, remaining, voltage_v, end, step_s)
    return end, thrusts, wrench, reach, after, seen, left


def observe(
    body: Body, motion: Motion, wrench: Wrench, wind: Vector3
) -> tuple[MotionRate, Vector3]:
    """The motion's derivative, and what the wind adds to its acceleration: drag less calm drag."""
    slope = derivative(body, motion, wrench, wind)
    wind_x, wind_y, wind_z = wind
    if wind_x == wind_y == wind_z == 0.0:
        return slope, (0.0, 0.0, 0.0)
    vx, vy, vz, w, x, y, z, _, _, _ = motion
    bx, by, bz = drag_acceleration(body, w, x, y, z, vx - wind_x, vy - wind_y, vz - wind_z)
    cx, cy, cz = drag_acceleration(body, w, x, y, z, vx, vy, vz)
    return slope, (bx - cx, by - cy, bz - cz)
