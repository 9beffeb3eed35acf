"""Commands as the vehicle meets them, and the linear responses to them, on a grid of 1 ms.

A command stands from the sample that it was decided on until the next one.  On a grid as fine as
the autopilot's clock that is exact, and a dead time is a shift along it, with the values between
two points of the grid interpolated: smooth enough to be fitted.
"""

import numpy as np

from companion.control.matrix_exponential import matrix_exponential
from companion.frames import euler_from_quaternion, rotate
from companion.identification.recording import Array, Recording

GRID_S = 1e-3
_UP = (0.0, 0.0, 1.0)
_SLACK_S = 1e-6
"""Against rounding in the sums of floats."""


def since_begin_s(recording: Recording) -> Array:
    """(n,) time of each sample since the first one."""
    times: Array = recording.time_s - recording.time_s[0]
    return times


def held(times_s: Array, values: Array, end_s: float) -> Array:
    """Values on the grid from 0 to `end_s`, each held until the next one.

    Args:
        times_s: (n,) rising, from 0 on.
        values: (n,)
        end_s: of the grid.
    """
    grid = np.arange(round(end_s / GRID_S) + 1) * GRID_S
    index = np.searchsorted(times_s, grid + _SLACK_S, side="right") - 1
    taken: Array = values[np.clip(index, 0, len(values) - 1)]
    return taken


def delayed(on_grid: Array, delay_s: float) -> Array:
    """The same signal later by a delay, on the same grid."""
    places = np.arange(len(on_grid), dtype=float)
    shifted: Array = np.interp(places - delay_s / GRID_S, places, on_grid)
    return shifted


def sampled(on_grid: Array, times_s: Array) -> Array:
    """(n,) a signal of the grid at given times."""
    values: Array = np.interp(times_s / GRID_S, np.arange(len(on_grid), dtype=float), on_grid)
    return values


def second_order(commanded: Array, natural_frequency_rad_s: float, damping: float) -> Array:
    """Response on the grid of ``ωn² / (s² + 2 ζ ωn s + ωn²)``, at rest at first.

    The input is held over each step of the grid, for which the discretisation is exact.

    Args:
        commanded: (n,) on the grid.
        natural_frequency_rad_s: ωn.
        damping: ζ.
    """
    from scipy.signal import lfilter

    square = natural_frequency_rad_s**2
    whole = matrix_exponential(
        GRID_S
        * np.array(
            [
                [0.0, 1.0, 0.0],
                [-square, -2.0 * damping * natural_frequency_rad_s, square],
                [0.0, 0.0, 0.0],
            ]
        )
    )
    (a, b), (c, d) = whole[:2, :2]
    drive, push = whole[:2, 2]
    numerator = [0.0, drive, b * push - d * drive]
    first = commanded[0]
    answer: Array = first + lfilter(numerator, [1.0, -(a + d), a * d - b * c], commanded - first)
    return answer


def accumulated(rate: Array, decay_1_s: float) -> Array:
    """Solution on the grid of ``v' = rate - decay · v`` from v = 0.

    Args:
        rate: (n,) on the grid, held over each step.
        decay_1_s: 0 or more.
    """
    from scipy.signal import lfilter

    keep = float(np.exp(-decay_1_s * GRID_S))
    step = GRID_S if decay_1_s < 1e-9 else (1.0 - keep) / decay_1_s
    answer: Array = lfilter([0.0, step], [1.0, -keep], rate)
    return answer


def roll_pitch_rad(recording: Recording) -> tuple[Array, Array]:
    """(n,) roll and (n,) pitch as reported, FLU."""
    angles = np.array(
        [euler_from_quaternion((w, x, y, z)) for w, x, y, z in _quaternions(recording)]
    )
    return angles[:, 0], angles[:, 1]


def up_vectors(recording: Recording) -> Array:
    """(n, 3) the body's up in ENU, as reported."""
    return np.array([rotate((w, x, y, z), _UP) for w, x, y, z in _quaternions(recording)])


def _quaternions(recording: Recording) -> list[list[float]]:
    rows: list[list[float]] = recording.attitude_flu_to_enu.tolist()
    return rows
