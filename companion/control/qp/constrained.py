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


# Not frozen, as that would make them four times as slow to make: change none.
@dataclass(slots=True)
class SoftBounds:
    """Of the predicted outputs, in the same coordinates as the problem's data."""

    speed_m_s: float
    low_m: float
    high_m: float


@dataclass(slots=True)
class AxisSolution:
    """A plan (n,), or None when the hard problem could not be solved."""

    plan: Array | None
    status: str
    iterations: int
    position: Array | None = None
    """(n,) where the plan leads to."""


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
        n = problem.hessian.shape[0]
        self._n = n
        self._limit = second_limit
        # Overwritten at each solve; the past is in the first two of each.
        self._lower, self._upper = np.full(n, -second_limit), np.full(n, second_limit)
        # Gradient, then velocities and positions of r = 0: all that the data say.
        free = np.zeros((2 * n, problem.gradient.shape[1]))
        free[:n, :2], free[n:, :2] = problem.velocity_from_state, problem.position_from_state
        self._from_data = np.vstack([problem.gradient, free])
        self._outputs_from_r = np.vstack([problem.velocity_from_r, problem.position_from_r])
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
        n = self._n
        upper, lower, limit = self._upper, self._lower, self._limit
        past = before_m - 2.0 * previous_m
        upper[0], upper[1] = limit - past, limit - previous_m
        lower[0], lower[1] = -limit - past, -limit - previous_m
        known = self._from_data.dot(data)
        gradient, free = known[:n], known[n:]
        hard = self._hard.solve(gradient, lower, upper)
        if hard.x is None:
            return AxisSolution(None, hard.status, hard.iterations)

        outputs = self._outputs_from_r.dot(hard.x)
        outputs += free
        position = outputs[n:]
        if _keeps(outputs[:n], position, bounds):
            return AxisSolution(hard.x, hard.status, hard.iterations, position)

        low = np.repeat([-bounds.speed_m_s, bounds.low_m], n) - free
        high = np.repeat([bounds.speed_m_s, bounds.high_m], n) - free
        soft = self._soft.solve(
            np.concatenate([gradient, np.zeros(2 * n)]),
            np.concatenate([lower, low]),
            np.concatenate([upper, high]),
        )
        iterations = hard.iterations + soft.iterations
        if soft.x is None:
            status = f"soft bounds dropped: {soft.status}"
            return AxisSolution(hard.x, status, iterations, position)
        plan = soft.x[:n]
        position = self._outputs_from_r[n:].dot(plan) + free[n:]
        return AxisSolution(plan, soft.status, iterations, position)


def _keeps(velocity: Array, position: Array, bounds: SoftBounds) -> bool:
    """Whether the outputs (n,) keep the soft bounds."""
    speed = bounds.speed_m_s + _TOLERANCE
    return (
        velocity.item(velocity.argmax()) <= speed
        and velocity.item(velocity.argmin()) >= -speed
        and position.item(position.argmin()) >= bounds.low_m - _TOLERANCE
        and position.item(position.argmax()) <= bounds.high_m + _TOLERANCE
    )


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
