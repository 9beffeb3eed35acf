"""Many sampled loops of one axis as matrices: what becomes of them, and of paths in them."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.control.reference_model import Array

Indices = NDArray[np.intp]

_DOUBLINGS = 10
"""Of the period's matrix: what is left after 1024 periods tells whether the loop is stable."""


@dataclass(frozen=True, slots=True)
class Loops:
    """The loops of (members, candidates); n states each, the position at `position_at`."""

    period: Array
    """(members, candidates, n, n) over one period, beginning with a plan."""
    from_reference: Array
    """(members, candidates, n): of what the preview adds to the plan's first reference."""
    from_gust: Array
    """(members, candidates, n): of a disturbance of 1, held over the period."""
    noise: Array
    """(members, candidates, n, n): covariance that noise adds in a period."""
    preview: Array
    """(candidates, longest horizon + 2): the weights of y* from now on in that reference."""
    position_at: int
    command_at: int
    sigma_at: int
    reference_at: int

    def part(self, members: Indices, candidates: Indices) -> "Loops":
        """Those of some members and candidates alone."""
        both = np.ix_(members, candidates)
        return replace(
            self,
            period=self.period[both],
            from_reference=self.from_reference[both],
            from_gust=self.from_gust[both],
            noise=self.noise[both],
            preview=self.preview[candidates],
        )


def radii(loops: Loops) -> Array:
    """(members, candidates) spectral radii over a period: the growth of the matrix's last powers.

    From the power 1024 to 2048, so that how much states of different units differ cancels.
    """
    power, size, before = (
        loops.period,
        np.zeros(loops.period.shape[:2]),
        0.0 * loops.noise[..., 0, 0],
    )
    for _ in range(_DOUBLINGS + 1):
        power, before = power @ power, size
        largest = np.maximum(np.abs(power).max(axis=(2, 3)), 1e-200)
        power, size = power / largest[..., None, None], 2.0 * size + np.log(largest)
    radius: Array = np.exp((size - before) * 0.5**_DOUBLINGS)
    return radius


def covariance(loops: Loops) -> Array:
    """(members, candidates, n, n) of the state by the noise alone; of stable loops."""
    power, total = loops.period, loops.noise
    for _ in range(_DOUBLINGS):
        total = total + power @ total @ transposed(power)
        power = power @ power
    return total


def responses(loops: Loops, desired_m: Array, gust: Array, steps: int) -> tuple[Array, Array]:
    """The reported position and r2 on trajectories without noise, from rest on their first point.

    Args:
        loops: stable ones.
        desired_m: (steps and preview, columns) y* at the times at which plans act.
        gust: (members, steps) disturbance.
        steps: periods.

    Returns:
        Positions and references, (steps, members, candidates, columns): at the plans.
    """
    reach = loops.preview.shape[1]
    windows = np.lib.stride_tricks.sliding_window_view(desired_m, reach, axis=0)[:steps]
    ahead = windows @ loops.preview.T  # (steps, columns, candidates)
    ahead = np.ascontiguousarray(ahead.transpose(0, 2, 1))
    members, count, n, _ = loops.period.shape
    columns = desired_m.shape[1]
    state = np.zeros((members, count, n, columns))
    state[:, :, loops.position_at] = desired_m[0]
    state[:, :, loops.reference_at :] = desired_m[0]
    positions = np.empty((steps, members, count, columns))
    references = np.empty_like(positions)
    from_reference = loops.from_reference[..., None]
    for k in range(steps):
        positions[k] = state[:, :, loops.position_at]
        state = loops.period @ state + from_reference * ahead[k][None, :, None, :]
        if gust[:, k].any():
            state += (loops.from_gust * gust[:, k, None, None])[..., None]
        references[k] = state[:, :, loops.reference_at]
    return positions, references


def transposed(matrices: Array) -> Array:
    """Of each matrix of a stack."""
    return np.swapaxes(matrices, -1, -2)
