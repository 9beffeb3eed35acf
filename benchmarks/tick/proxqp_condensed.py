"""ProxQP's dense method, one instance per axis, the states eliminated.

Each solve begins at the unconstrained optimum, ProxQP's default: begun at the result before, some
of these problems never end.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.problem import AXES, Problem, TickInput, vectors_of
from companion.control.reference_model import Array

_TOLERANCE = 1e-8


def make(problem: Problem, ticks: Sequence[TickInput]) -> Made:
    """Set an instance up for each axis."""
    from proxsuite import proxqp

    solvers: list[Any] = []
    for axis in problem.axes:
        n = len(axis.hessian)
        solver = proxqp.dense.QP(n, 0, n)
        solver.settings.eps_abs = _TOLERANCE
        solver.settings.eps_rel = 0.0
        solver.settings.initial_guess = proxqp.EQUALITY_CONSTRAINED_INITIAL_GUESS
        solver.init(
            axis.hessian, np.zeros(n), None, None, axis.second_difference, -np.ones(n), np.ones(n)
        )
        solvers.append(solver)

    def step(k: int) -> Array:
        tick = ticks[k]
        gradient, lower, upper = vectors_of(problem, tick)
        first = np.empty(AXES)
        for i, solver in enumerate(solvers):
            solver.update(g=gradient[i], l=lower[i], u=upper[i])
            solver.solve()
            first[i] = solver.results.x[0]
        return first + tick.preview_m[0]

    return Made(step)


CONTENDERS = [
    Contender("ProxQP dense, per axis", "library", make, "proxsuite", f"eps {_TOLERANCE:g}")
]
