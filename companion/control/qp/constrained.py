"""The constrained optimum of one axis, by a solver behind the port.

The hard bound on the second difference of r comes first: that problem is small and quick.  Only
if its optimum violates a soft bound on velocity or position is the larger problem solved, in
which each bounded output has a slack with a quadratic price.  (One slack for all, or a linear
price, make ADMM crawl: thousands of iterations instead of hundreds.)  Should that solve fail, the
first optimum stands: it keeps what is hard.
"""

from dataclasses import dataclass

import numpy as np

from companion.control.qp.condensed import AxisProblem
from companion.control.qp.port import QpSolverFactory
from companion.control.reference_model import Array

_SLACK_WEIGHT = 30.0
"""Price of a squared metre, or metre per second, outside a soft bound (q is 17 by default)."""
_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class SoftBounds:
    """Of the predicted outputs, in the same coordinates as the problem's data."""

    speed_m_s: float
    low_m: float
    high_m: float


@dataclass(frozen=True, slots=True)
class AxisSolution:
    """A plan (n,), or None when the hard problem could not be solved."""

    plan: Array | None
    status: str
    iterations: int


class ConstrainedAxis:
    """Solvers of one axis, set up at construction (which may take long) and warm-started."""

    def __init__(
        self, problem: AxisProblem, second_limit: float, make_solver: QpSolverFactory
    ) -> None:
        """Prepare.

        Args:
            problem: the condensed problem.
            second_limit: bound of |r(k) - 2 r(k-1) + r(k-2)|, m.
            make_solver: sets solvers up.
        """
        self._problem = problem
        self._limit = second_limit
        self._hard = make_solver(problem.hessian, problem.second_difference)
        self._soft = make_solver(*_with_slacks(problem))

    def solve(
        self, data: Array, previous_m: float, before_m: float, bounds: SoftBounds
    ) -> AxisSolution:
        """Solve for one tick.

        Args:
            data: what the problem's gradient is a function of.
            previous_m: reference applied last.
            before_m: the one before.
            bounds: soft bounds.
        """
        problem = self._problem
        n = problem.hessian.shape[0]
        past = np.zeros(n)
        past[0] = before_m - 2.0 * previous_m
        past[1] += previous_m
        lower, upper = -self._limit - past, self._limit - past
        gradient = problem.gradient @ data
        hard = self._hard.solve(gradient, lower, upper)
        if hard.x is None:
            return AxisSolution(None, hard.status, hard.iterations)

        free_velocity = problem.velocity_from_state @ data[:2]
        free_position = problem.position_from_state @ data[:2]
        velocity = free_velocity + problem.velocity_from_r @ hard.x
        position = free_position + problem.position_from_r @ hard.x
        excess = max(
            float(np.abs(velocity).max()) - bounds.speed_m_s,
            bounds.low_m - float(position.min()),
            float(position.max()) - bounds.high_m,
        )
        if excess <= _TOLERANCE:
            return AxisSolution(hard.x, hard.status, hard.iterations)

        soft = self._soft.solve(
            np.concatenate([gradient, np.zeros(2 * n)]),
            np.concatenate(
                [lower, -bounds.speed_m_s - free_velocity, bounds.low_m - free_position]
            ),
            np.concatenate(
                [upper, bounds.speed_m_s - free_velocity, bounds.high_m - free_position]
            ),
        )
        iterations = hard.iterations + soft.iterations
        if soft.x is None:
            return AxisSolution(hard.x, f"soft bounds dropped: {soft.status}", iterations)
        return AxisSolution(soft.x[:n], soft.status, iterations)


def _with_slacks(problem: AxisProblem) -> tuple[Array, Array]:
    """Hessian and constraints with a slack for each velocity and each position."""
    n = problem.hessian.shape[0]
    hessian = np.zeros((3 * n, 3 * n))
    hessian[:n, :n] = problem.hessian
    hessian[n:, n:] = _SLACK_WEIGHT * np.eye(2 * n)
    zero, one = np.zeros((n, n)), np.eye(n)
    constraints = np.block(
        [
            [problem.second_difference, zero, zero],
            [problem.velocity_from_r, -one, zero],
            [problem.position_from_r, zero, -one],
        ]
    )
    return hessian, constraints
