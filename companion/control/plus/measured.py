"""Between a tilt and the horizontal acceleration that it makes, ENU.

The thrust of a vehicle that keeps its height has the vertical part F per mass; tilted, it pushes
with F times the tangent of the tilt.
"""

import math
from collections.abc import Sequence

import numpy as np

from companion.control.reference_model import Array
from companion.frames import rotate
from companion.vehicle_state import VehicleState

_LEAST_COSINE = 0.2


def tilt_acceleration(state: VehicleState, force_m_s2: float) -> Array:
    """`tilt_motion` as an array (2, 2)."""
    return np.array(tilt_motion(state, force_m_s2))


def tilt_motion(
    state: VehicleState, force_m_s2: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """By horizontal axis: acceleration by the measured tilt, m/s², and its rate, m/s³.

    Args:
        state: attitude and body rates.
        force_m_s2: F, times the vehicle's tilt gain.
    """
    q = state.attitude_flu_to_enu
    x, y, z = rotate(q, (0.0, 0.0, 1.0))
    turn_x, turn_y, _ = state.rate_flu_rad_s
    dx, dy, dz = rotate(q, (turn_y, -turn_x, 0.0))
    z = max(_LEAST_COSINE, z)
    per_z, per_square = force_m_s2 / z, force_m_s2 / (z * z)
    return (
        (per_z * x, per_square * (dx * z - x * dz)),
        (per_z * y, per_square * (dy * z - y * dz)),
    )


def thrust_direction(
    asked_m_s2: Sequence[float] | Array, force_m_s2: float
) -> tuple[float, float, float]:
    """Unit vector (ENU) of the thrust that makes a horizontal acceleration (2,)."""
    x, y = float(asked_m_s2[0]), float(asked_m_s2[1])
    length = math.sqrt(x * x + y * y + force_m_s2 * force_m_s2)
    return x / length, y / length, force_m_s2 / length


def roll_pitch(direction: tuple[float, float, float], yaw_rad: float) -> tuple[float, float]:
    """Roll and pitch (rad, FLU) at a yaw (ENU) that point the thrust in a direction (ENU)."""
    sine, cosine = math.sin(yaw_rad), math.cos(yaw_rad)
    x, y, z = direction
    return -math.asin(y * cosine - x * sine), math.atan2(x * cosine + y * sine, z)
