"""OSQP, given the problem as it is written: states and references of all axes, sparse, at once."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.osqp_settings import SPARSE_TOLERANCE, settings
from benchmarks.tick.problem import AXES, WEIGHTS, Problem, TickInput
from companion.control.reference_model import Array

_ROWS = 3
"""Per axis and step: two of the dynamics, one of the second difference."""


def make(problem: Problem, ticks: Sequence[TickInput]) -> Made:
    """Set one instance up for the three axes together.

    Variables per axis: (y2, y1) at k̄+1 … k̄+N_h+1, then r at k̄ … k̄+N_h, about the desired
    position at k̄.
    """
    import osqp
    from scipy import sparse

    n = problem.horizon + 1
    difference = problem.axes[0].difference
    second = sparse.csc_matrix(problem.axes[0].second_difference)
    of_states = sparse.kron(sparse.eye(n), np.diag([WEIGHTS.q, 0.0]))
    of_r = WEIGHTS.r * np.eye(n) + WEIGHTS.s * difference.T @ difference
    blocks_p, blocks_a = [], []
    for axis in range(AXES):
        blocks_p += [of_states, sparse.csc_matrix(of_r)]
        forward = sparse.kron(sparse.eye(n, k=-1), problem.a[axis]) - sparse.eye(2 * n)
        driven = sparse.kron(sparse.eye(n), problem.b[axis][:, None])
        nothing = sparse.csc_matrix((n, 2 * n))
        blocks_a.append(sparse.bmat([[forward, driven], [nothing, second]]))
    p = sparse.block_diag(blocks_p, format="csc")
    a = sparse.block_diag(blocks_a, format="csc")

    q = np.zeros((AXES, 3 * n))
    lower = np.zeros((AXES, _ROWS * n))
    lower[:, 2 * n :] = -problem.second_limit_m
    upper = np.zeros((AXES, _ROWS * n))
    upper[:, 2 * n :] = problem.second_limit_m
    solver: Any = osqp.OSQP()
    solver.setup(
        sparse.triu(p, format="csc"),
        q.ravel(),
        a,
        lower.ravel(),
        upper.ravel(),
        **settings(SPARSE_TOLERANCE),
    )
    limit = problem.second_limit_m

    def step(k: int) -> Array:
        tick = ticks[k]
        centre = tick.preview_m[0]
        desired = (tick.preview_m - centre).T
        q[:, : 2 * n : 2] = -WEIGHTS.q * desired[:, 1:]
        q[:, 2 * n :] = -WEIGHTS.r * desired[:, :n]
        previous, before = tick.previous_m - centre, tick.before_m - centre
        q[:, 2 * n] -= WEIGHTS.s * previous
        state = np.stack([tick.position_m - centre, tick.velocity_m_s], axis=1)
        start = -(problem.a @ state[:, :, None])[:, :, 0]
        lower[:, :2] = start
        upper[:, :2] = start
        past = 2.0 * previous - before
        lower[:, 2 * n] = past - limit
        upper[:, 2 * n] = past + limit
        lower[:, 2 * n + 1] = -previous - limit
        upper[:, 2 * n + 1] = -previous + limit
        solver.update(q=q.ravel(), l=lower.ravel(), u=upper.ravel())
        result = solver.solve(raise_error=False)
        first: Array = result.x[2 * n :: 3 * n] + centre
        return first

    return Made(step)


CONTENDERS = [
    Contender(
        "OSQP sparse, three axes jointly",
        "library",
        make,
        "osqp",
        f"eps {SPARSE_TOLERANCE:g}, warm",
    )
]
