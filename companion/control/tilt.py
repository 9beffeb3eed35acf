"""From the control input u to roll and pitch, as in the paper, and back.

``φ_des = -arcsin(-u_x sin ψ + u_y cos ψ)``, ``θ_des = arcsin(u_x cos ψ + u_y sin ψ)``: u is the
sine of the tilt in world axes (ENU), angles are of the body FLU (positive pitch is nose down).
"""

import math


def limit_tilt(u_x: float, u_y: float, tilt_limit_rad: float) -> tuple[float, float]:
    """Scale the horizontal u, as a vector, to at most the sine of the tilt limit."""
    limit = math.sin(tilt_limit_rad)
    length = math.hypot(u_x, u_y)
    if length <= limit:
        return u_x, u_y
    return u_x * limit / length, u_y * limit / length


def roll_pitch_from_u(u_x: float, u_y: float, yaw_rad: float) -> tuple[float, float]:
    """Desired roll and pitch (rad, FLU) for a horizontal u with |u| ≤ 1 at the current yaw (ENU).

    Raises:
        ValueError: u is longer than 1 (limit it first).
    """
    if math.hypot(u_x, u_y) > 1.0:
        raise ValueError(f"u = ({u_x:g}, {u_y:g}) is longer than 1: limit the tilt first")
    sine, cosine = math.sin(yaw_rad), math.cos(yaw_rad)
    roll = -math.asin(-u_x * sine + u_y * cosine)
    pitch = math.asin(u_x * cosine + u_y * sine)
    return roll, pitch


def u_from_roll_pitch(roll_rad: float, pitch_rad: float, yaw_rad: float) -> tuple[float, float]:
    """Inverse of `roll_pitch_from_u`: the u that corresponds to an attitude."""
    sine, cosine = math.sin(yaw_rad), math.cos(yaw_rad)
    forward, left = math.sin(pitch_rad), -math.sin(roll_rad)
    return forward * cosine - left * sine, forward * sine + left * cosine
