"""PIQP's dense interior-point method, one instance per axis, the states eliminated."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.problem import AXES, Problem, TickInput, vectors_of
from companion.control.reference_model import Array

_TOLERANCE = 1e-8


def make(problem: Problem, ticks: Sequence[TickInput]) -> Made:
    """Set an instance up for each axis."""
    import piqp

    solvers: list[Any] = []
    for axis in problem.axes:
        n = len(axis.hessian)
        solver = piqp.DenseSolver()
        solver.settings.verbose = False
        solver.settings.compute_timings = False
        solver.settings.eps_abs = _TOLERANCE
        solver.settings.eps_rel = _TOLERANCE
        hessian, second = (np.asfortranarray(m) for m in (axis.hessian, axis.second_difference))
        solver.setup(hessian, np.zeros(n), None, None, second, -np.ones(n), np.ones(n))
        solvers.append(solver)

    def step(k: int) -> Array:
        tick = ticks[k]
        gradient, lower, upper = vectors_of(problem, tick)
        first = np.empty(AXES)
        for i, solver in enumerate(solvers):
            solver.update(c=gradient[i], h_l=lower[i], h_u=upper[i])
            solver.solve()
            first[i] = solver.result.x[0]
        return first + tick.preview_m[0]

    return Made(step)


CONTENDERS = [Contender("PIQP dense, per axis", "library", make, "piqp", f"eps {_TOLERANCE:g}")]
