"""The floor: the closed form for all axes in one product, with no look at any constraint."""

from collections.abc import Sequence

import numpy as np

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.problem import AXES, Problem, TickInput
from companion.control.reference_model import Array

_PREVIEW = 3
"""Rows before the preview: position, velocity, the reference that was applied last."""


def make(problem: Problem, ticks: Sequence[TickInput]) -> Made:
    """Make one product of it, from what is given to the plan, both about the world's origin."""
    gain = _about_the_origin(problem)
    rows = _PREVIEW + problem.horizon + 2

    def step(k: int) -> Array:
        tick = ticks[k]
        data = np.empty((rows, AXES))
        data[0] = tick.position_m
        data[1] = tick.velocity_m_s
        data[2] = tick.previous_m
        data[_PREVIEW:] = tick.preview_m
        plan = (gain @ data.T[:, :, None])[:, :, 0]
        first: Array = plan[:, 0]
        return first

    return Made(step)


def _about_the_origin(problem: Problem) -> Array:
    """The gain (axes, n, 3 + N_h + 2) of what is not taken relative to the desired position."""
    n = problem.horizon + 1
    relative = np.zeros((3 + 2 * n, _PREVIEW + n + 1))
    relative[:_PREVIEW, :_PREVIEW] = np.eye(_PREVIEW)
    relative[3 : 3 + n, _PREVIEW + 1 :] = np.eye(n)
    relative[3 + n :, _PREVIEW : _PREVIEW + n] = np.eye(n)
    relative[[0, 2, *range(3, 3 + 2 * n)], _PREVIEW] -= 1.0
    gain: Array = problem.gain @ relative
    gain[:, :, _PREVIEW] += 1.0
    return gain


CONTENDERS = [
    Contender("closed form, no check", "floor", make, settings="violates what is constrained")
]
