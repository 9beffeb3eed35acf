"""DAQP, one instance per axis, the states eliminated; every tick goes to the solver."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.problem import AXES, Problem, TickInput, vectors_of
from companion.control.reference_model import Array


def make(problem: Problem, ticks: Sequence[TickInput]) -> Made:
    """Set an instance up for each axis."""
    import daqp

    solvers: list[Any] = []
    for axis in problem.axes:
        n = len(axis.hessian)
        solver = daqp.Model()
        hessian, second = (np.ascontiguousarray(m) for m in (axis.hessian, axis.second_difference))
        solver.setup(hessian, np.zeros(n), second, np.ones(n), -np.ones(n))
        solvers.append(solver)

    def step(k: int) -> Array:
        tick = ticks[k]
        gradient, lower, upper = vectors_of(problem, tick)
        first = np.empty(AXES)
        for i, solver in enumerate(solvers):
            solver.update(f=gradient[i], bupper=upper[i], blower=lower[i])
            first[i] = solver.solve()[0][0]
        return first + tick.preview_m[0]

    return Made(step)


CONTENDERS = [
    Contender("DAQP condensed, per axis", "library", make, "daqp", "default, warm active set")
]
