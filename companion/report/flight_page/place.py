"""Where on the desired path something happened, in words: in a left turn, on the climb."""

import numpy as np

from companion.report.flight_data import Array

_WINDOW_S = 0.15
"""Velocities and accelerations of the path are differences over this long."""
_STANDS_M_S = 0.1
_TURNS_M_S2 = 0.4
"""Sideways; a circle of 1 m flown at 0.63 m/s has as much."""
_STEEP = 1.0
"""Vertical over horizontal speed."""
_CHANGES_SPEED_M_S2 = 0.8


def place_on_path(times_s: Array, desired_enu_m: Array, at_s: float) -> str:
    """Like "in a left turn"; empty where the path is not known around it.

    Args:
        times_s: (n,) of the reference.
        desired_enu_m: (n, 3), rows that are not known may be NaN.
        at_s: when.
    """
    known = np.isfinite(desired_enu_m).all(axis=1)
    times, path = times_s[known], desired_enu_m[known]
    if len(times) < 3 or not times[0] <= at_s <= times[-1]:
        return ""
    # At the ends of the path the window lies inside it.
    middle = min(max(at_s, times[0] + _WINDOW_S), times[-1] - _WINDOW_S)
    moments = middle + np.array([-_WINDOW_S, 0.0, _WINDOW_S])
    before, now, after = np.stack([np.interp(moments, times, path[:, k]) for k in range(3)], axis=1)
    velocity = (after - before) / (2.0 * _WINDOW_S)
    acceleration = (after - 2.0 * now + before) / _WINDOW_S**2
    level = float(np.hypot(velocity[0], velocity[1]))
    if float(np.linalg.norm(velocity)) < _STANDS_M_S:
        return "where the path turns back" if _moves(acceleration) else "while it stood still"
    if abs(velocity[2]) > _STEEP * level:
        return "on the climb" if velocity[2] > 0.0 else "on the descent"
    cross = velocity[0] * acceleration[1] - velocity[1] * acceleration[0]
    sideways = float(cross / level)
    if abs(sideways) > _TURNS_M_S2:
        return "in a left turn" if sideways > 0.0 else "in a right turn"
    along = float(np.dot(velocity, acceleration) / np.linalg.norm(velocity))
    if abs(along) > _CHANGES_SPEED_M_S2:
        return "while speeding up" if along > 0.0 else "while slowing down"
    return "on a straight"


def _moves(acceleration_m_s2: Array) -> bool:
    return float(np.linalg.norm(acceleration_m_s2)) > _CHANGES_SPEED_M_S2
