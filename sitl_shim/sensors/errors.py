"""What an estimator's errors do to the truth, as an equation of floats and tuples of floats.

It runs as it is, or compiled (`sitl_shim.compiled`), with the same results.
"""

from math import cos, sin, sqrt

import numpy as np
import numpy.typing as npt

from sitl_shim.frames import Quaternion, Vector3

Noise = tuple[float, ...] | npt.NDArray[np.float64]
"""Of position, velocity, half angles (roll, pitch, yaw), rate, acceleration; then what is used
elsewhere: 24 numbers in all."""


def with_errors(
    noise: Noise,
    position: Vector3,
    velocity: Vector3,
    attitude: Quaternion,
    rate: Vector3,
    acceleration: Vector3,
    half_wander: Vector3,
    drift_position: Vector3,
    drift_velocity: Vector3,
) -> tuple[Vector3, Vector3, Quaternion, Vector3, Vector3]:
    """Position, velocity, attitude, rate and acceleration as they are estimated.

    The attitude is the truth with a yaw error about up (from the left) and a tilt error (from the
    right).  Roll and pitch error are a rotation vector of a few degrees, taken to second order.
    """
    w, x, y, z = attitude
    half_roll = half_wander[0] + noise[6]
    half_pitch = half_wander[1] + noise[7]
    half_yaw = half_wander[2] + noise[8]
    rest = 1.0 - 0.5 * (half_roll * half_roll + half_pitch * half_pitch)
    w, x, y, z = (
        w * rest - x * half_roll - y * half_pitch,
        x * rest + w * half_roll - z * half_pitch,
        y * rest + w * half_pitch + z * half_roll,
        z * rest + x * half_pitch - y * half_roll,
    )
    if half_yaw != 0.0:
        c, s = cos(half_yaw), sin(half_yaw)
        w, x, y, z = c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w
    scale = 1.0 / sqrt(w * w + x * x + y * y + z * z)
    return (
        (
            position[0] + drift_position[0] + noise[0],
            position[1] + drift_position[1] + noise[1],
            position[2] + drift_position[2] + noise[2],
        ),
        (
            velocity[0] + drift_velocity[0] + noise[3],
            velocity[1] + drift_velocity[1] + noise[4],
            velocity[2] + drift_velocity[2] + noise[5],
        ),
        (w * scale, x * scale, y * scale, z * scale),
        (rate[0] + noise[9], rate[1] + noise[10], rate[2] + noise[11]),
        (
            acceleration[0] + noise[12],
            acceleration[1] + noise[13],
            acceleration[2] + noise[14],
        ),
    )
