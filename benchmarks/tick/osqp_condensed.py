"""OSQP, one instance per axis, the states eliminated; every tick goes to the solver."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.osqp_settings import CONDENSED_TOLERANCE, settings
from benchmarks.tick.problem import AXES, Problem, TickInput, vectors_of
from companion.control.reference_model import Array


def make(problem: Problem, ticks: Sequence[TickInput]) -> Made:
    """Set an instance up for each axis."""
    import osqp
    from scipy import sparse

    solvers: list[Any] = []
    for axis in problem.axes:
        n = len(axis.hessian)
        solver = osqp.OSQP()
        hessian = sparse.csc_matrix(np.triu(axis.hessian))
        second = sparse.csc_matrix(axis.second_difference)
        solver.setup(
            hessian,
            np.zeros(n),
            second,
            -np.ones(n),
            np.ones(n),
            **settings(CONDENSED_TOLERANCE),
        )
        solvers.append(solver)

    def step(k: int) -> Array:
        tick = ticks[k]
        gradient, lower, upper = vectors_of(problem, tick)
        first = np.empty(AXES)
        for i, solver in enumerate(solvers):
            solver.update(q=gradient[i], l=lower[i], u=upper[i])
            first[i] = solver.solve(raise_error=False).x[0]
        return first + tick.preview_m[0]

    return Made(step)


CONTENDERS = [
    Contender(
        "OSQP condensed, per axis",
        "library",
        make,
        "osqp",
        f"eps {CONDENSED_TOLERANCE:g}, warm",
    )
]
