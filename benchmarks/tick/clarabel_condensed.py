"""Clarabel's interior-point method, one instance per axis, the states eliminated."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.problem import AXES, Problem, TickInput, vectors_of
from companion.control.reference_model import Array

_TOLERANCE = 1e-9


def make(problem: Problem, ticks: Sequence[TickInput]) -> Made:
    """Set an instance up for each axis; only vectors change, so its presolve stays off."""
    import clarabel
    from scipy import sparse

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.presolve_enable = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _TOLERANCE
    settings.max_threads = 1
    solvers: list[Any] = []
    for axis in problem.axes:
        n = len(axis.hessian)
        both = sparse.csc_matrix(np.vstack([axis.second_difference, -axis.second_difference]))
        hessian = sparse.csc_matrix(np.triu(axis.hessian))
        cones = [clarabel.NonnegativeConeT(2 * n)]
        solvers.append(
            clarabel.DefaultSolver(hessian, np.zeros(n), both, np.ones(2 * n), cones, settings)
        )

    def step(k: int) -> Array:
        tick = ticks[k]
        gradient, lower, upper = vectors_of(problem, tick)
        limits = np.concatenate([upper, -lower], axis=1)
        first = np.empty(AXES)
        for i, solver in enumerate(solvers):
            solver.update(q=gradient[i], b=limits[i])
            first[i] = solver.solve().x[0]
        return first + tick.preview_m[0]

    return Made(step)


CONTENDERS = [
    Contender(
        "Clarabel, per axis", "library", make, "clarabel", f"tolerances {_TOLERANCE:g}", slow=True
    )
]
