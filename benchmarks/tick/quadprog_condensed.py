"""quadprog's dual active-set method (GPL), per axis, the Hessian factored once; it starts cold."""

from collections.abc import Sequence

import numpy as np

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.problem import AXES, Problem, TickInput, vectors_of
from companion.control.reference_model import Array


def make(problem: Problem, ticks: Sequence[TickInput]) -> Made:
    """Factor the Hessians."""
    import quadprog

    inverse_roots, both = [], []
    for axis in problem.axes:
        root = np.linalg.cholesky(axis.hessian).T
        inverse_roots.append(np.linalg.inv(root))
        second = axis.second_difference
        both.append(np.ascontiguousarray(np.vstack([second, -second]).T))

    def step(k: int) -> Array:
        tick = ticks[k]
        gradient, lower, upper = vectors_of(problem, tick)
        downhill = -gradient
        limits = np.concatenate([lower, -upper], axis=1)
        first = np.empty(AXES)
        for i in range(AXES):
            found = quadprog.solve_qp(
                inverse_roots[i], downhill[i], both[i], limits[i], factorized=True
            )
            first[i] = found[0][0]
        return first + tick.preview_m[0]

    return Made(step)


CONTENDERS = [Contender("quadprog, per axis", "library", make, "quadprog", "default")]
