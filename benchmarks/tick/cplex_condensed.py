"""CPLEX, the paper's solver, in its community edition: per axis, the states eliminated.

The community edition takes problems of at most 1,000 variables and 1,000 rows; N_h 80 has 81 of
each.  Its dual simplex is by far the quickest of its methods on these.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.problem import AXES, Problem, TickInput, vectors_of
from companion.control.reference_model import Array

_DUAL_SIMPLEX = 2


def make(problem: Problem, ticks: Sequence[TickInput]) -> Made:
    """Set a model up for each axis."""
    import cplex

    models: list[Any] = []
    for axis in problem.axes:
        n = len(axis.hessian)
        model = cplex.Cplex()
        for channel in ("log", "results", "warning", "error"):
            getattr(model, f"set_{channel}_stream")(None)
        model.parameters.threads.set(1)
        model.parameters.qpmethod.set(_DUAL_SIMPLEX)
        model.variables.add(lb=[-cplex.infinity] * n, ub=[cplex.infinity] * n)
        columns = list(range(n))
        symmetric = 0.5 * (axis.hessian + axis.hessian.T)
        model.objective.set_quadratic([(columns, row.tolist()) for row in symmetric])
        rows = []
        for row in axis.second_difference:
            filled = np.flatnonzero(row)
            rows.append((filled.tolist(), row[filled].tolist()))
        # A range of -w goes from the right-hand side down by w.
        model.linear_constraints.add(
            lin_expr=rows,
            senses="R" * n,
            rhs=[problem.second_limit_m] * n,
            range_values=[-2.0 * problem.second_limit_m] * n,
        )
        models.append(model)

    def step(k: int) -> Array:
        tick = ticks[k]
        gradient, _, upper = vectors_of(problem, tick)
        first = np.empty(AXES)
        for i, model in enumerate(models):
            model.objective.set_linear(enumerate(gradient[i].tolist()))
            # Only the first two bounds know the past.
            model.linear_constraints.set_rhs([(0, float(upper[i, 0])), (1, float(upper[i, 1]))])
            model.solve()
            first[i] = model.solution.get_values(0)
        return first + tick.preview_m[0]

    return Made(step)


CONTENDERS = [
    Contender(
        "CPLEX (the paper's), per axis",
        "library",
        make,
        "cplex",
        "community edition, dual simplex, one thread",
        slow=True,
    )
]
