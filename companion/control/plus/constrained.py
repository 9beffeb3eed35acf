"""The preview MPC of MPC-L1+ where a constraint is active.

Over N steps, per axis, in the deviation from the flat solution (`feedback.py` has the cost and the
optimum without constraints, whose cost-to-go ends the horizon):

* hard: the input (tilt, thrust or climb rate) and its rate (tilt rate);
* soft: velocity, and a geofence box, each with a slack of quadratic price.

The horizon is looked at along the unconstrained optimum first; only axes on which that leaves a
bound go to the solver.
"""

from dataclasses import dataclass

import numpy as np

from companion.control.plus.feedback import AUGMENTED, FeedbackSettings, riccati
from companion.control.plus.nominal_plant import STATES, NominalPlant
from companion.control.qp.port import QpSolution, QpSolver, QpSolverFactory
from companion.control.reference_model import Array

_SLACK_PRICE = 30.0
"""Of a squared metre, or metre per second, outside a soft bound at a step; a squared metre of error
costs 1 for a second."""
_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class Horizon:
    """Of the plan."""

    step_s: float
    steps: int


@dataclass(frozen=True, slots=True)
class Bounds:
    """Along the horizon, for one axis; each (steps,)."""

    input_low: Array
    input_high: Array
    input_step: float
    """Of the change of u from step to step."""
    speed: float
    low_m: float
    high_m: float


@dataclass(frozen=True, slots=True)
class Flat:
    """The flat solution along the horizon, for one axis."""

    input: Array
    """(steps,) u* at the beginning of each step."""
    position: Array
    """(steps,) p* at the end of each step."""
    velocity: Array
    """(steps,) v* at the end of each step."""


class _Whitened:
    """A solver for ½ xᵀ P x + qᵀ x in y = Lᵀ x, P = L Lᵀ, where the cost is ½ |y|² + ….

    As it stands the cost is too flat for a first-order solver: changes of the input late in the
    horizon cost next to nothing beside a slack.
    """

    def __init__(self, p: Array, a: Array, make_solver: QpSolverFactory) -> None:
        self._inverse = np.linalg.inv(np.linalg.cholesky(p))
        self._solver: QpSolver = make_solver(np.eye(len(p)), a @ self._inverse.T)

    def solve(self, q: Array, lower: Array, upper: Array) -> QpSolution:
        """See `QpSolver`."""
        found = self._solver.solve(self._inverse @ q, lower, upper)
        if found.x is None:
            return found
        return QpSolution(self._inverse.T @ found.x, found.status, found.iterations)


class AxisPlan:
    """The problem of one axis, set up once.

    Its only side effect is the solvers' warm start.
    """

    def __init__(
        self,
        settings: FeedbackSettings,
        plant: NominalPlant,
        axis: int,
        horizon: Horizon,
        make_solver: QpSolverFactory,
    ) -> None:
        step = FeedbackSettings(settings.bandwidth_rad_s, settings.rate_time_s, horizon.step_s)
        problem = riccati(step, plant, axis)
        full_a, full_b = problem.a, problem.b
        closed = full_a - np.outer(full_b, problem.gain)
        n = horizon.steps
        free, change = np.empty((n, AUGMENTED, AUGMENTED)), np.zeros((n, AUGMENTED, n))
        optimal = np.empty((n, AUGMENTED, AUGMENTED))
        power, best = np.eye(AUGMENTED), np.eye(AUGMENTED)
        for k in range(n):
            for j in range(k):
                change[k, :, j] = full_a @ change[k - 1, :, j]
            change[k, :, k] = full_b
            power, best = full_a @ power, closed @ best
            free[k], optimal[k] = power, best
        self._free, self._change, self._optimal = free, change, optimal
        q = problem.stage
        hessian, cross = np.zeros((n, n)), np.zeros((n, AUGMENTED))
        # Stage k costs the state at its beginning and w over it: [x_k, w_k + Δ_k, Δ_k].
        for k in range(n):
            from_change = change[k - 1] if k else np.zeros((AUGMENTED, n))
            from_start = free[k - 1] if k else np.eye(AUGMENTED)
            unit = np.zeros(n)
            unit[k] = 1.0
            rows = np.vstack([from_change, unit])
            starts = np.vstack([from_start, np.zeros(AUGMENTED)])
            hessian += rows.T @ q @ rows
            cross += rows.T @ q @ starts
        hessian += change[-1].T @ problem.cost @ change[-1]
        cross += change[-1].T @ problem.cost @ free[-1]
        self._hessian, self._cross = hessian, cross
        w_rows = change[:, STATES, :]
        differences = np.eye(n)
        self._hard_rows = np.vstack([w_rows, differences])
        velocity, position = change[:, 1, :], change[:, 0, :]
        self._hard: QpSolver = _Whitened(hessian, self._hard_rows, make_solver)
        soft_hessian = np.zeros((3 * n, 3 * n))
        soft_hessian[:n, :n] = hessian
        soft_hessian[n:, n:] = _SLACK_PRICE * np.eye(2 * n)
        nothing, one = np.zeros((n, n)), np.eye(n)
        rows = np.block(
            [
                [self._hard_rows, np.zeros((2 * n, 2 * n))],
                [velocity, -one, nothing],
                [position, nothing, -one],
            ]
        )
        self._soft: QpSolver = _Whitened(soft_hessian, rows, make_solver)

    def violated(self, start: Array, flat: Flat, bounds: Bounds) -> tuple[bool, Array]:
        """Whether the unconstrained optimum leaves a bound, and the positions (steps,) on its way.

        Args:
            start: (5,) deviation of the state, and w.
            flat: the flat solution.
            bounds: along it.
        """
        way = self._optimal @ start
        u = flat.input + way[:, STATES]
        steps = u.copy()
        steps[0] -= flat.input[0] + start[STATES]
        steps[1:] -= u[:-1]
        position, velocity = flat.position + way[:, 0], flat.velocity + way[:, 1]
        beyond = np.concatenate(
            [
                u - bounds.input_high,
                bounds.input_low - u,
                np.abs(steps) - bounds.input_step,
                np.abs(velocity) - bounds.speed,
                bounds.low_m - position,
                position - bounds.high_m,
            ]
        )
        return bool(beyond[beyond.argmax()] > _TOLERANCE), position

    def solve(self, start: Array, flat: Flat, bounds: Bounds) -> "AxisSolution":
        """The constrained optimum; arguments as for `violated`."""
        n = len(flat.input)
        gradient = self._cross @ start
        free = self._free @ start
        low = bounds.input_low - flat.input - free[:, STATES]
        high = bounds.input_high - flat.input - free[:, STATES]
        steps = np.diff(flat.input, prepend=flat.input[0])
        # A start outside of the bounds must come back as quickly as the rate allows, and no faster.
        reach = np.cumsum(np.full(n, bounds.input_step) + np.abs(steps))
        low, high = np.minimum(low, reach), np.maximum(high, -reach)
        lower = np.concatenate([low, -bounds.input_step - steps])
        upper = np.concatenate([high, bounds.input_step - steps])
        hard = self._hard.solve(gradient, lower, upper)
        if hard.x is None:
            return AxisSolution(None, hard.status, hard.iterations)
        way = free + self._change @ hard.x
        velocity, position = flat.velocity + way[:, 1], flat.position + way[:, 0]
        excess = max(
            float(np.abs(velocity).max()) - bounds.speed,
            bounds.low_m - float(position.min()),
            float(position.max()) - bounds.high_m,
        )
        if excess <= _TOLERANCE:
            return AxisSolution(float(hard.x[0]), hard.status, hard.iterations)
        still, where = flat.velocity + free[:, 1], flat.position + free[:, 0]
        soft = self._soft.solve(
            np.concatenate([gradient, np.zeros(2 * n)]),
            np.concatenate([lower, -bounds.speed - still, bounds.low_m - where]),
            np.concatenate([upper, bounds.speed - still, bounds.high_m - where]),
        )
        iterations = hard.iterations + soft.iterations
        if soft.x is None:
            status = f"soft bounds dropped: {soft.status}"
            return AxisSolution(float(hard.x[0]), status, iterations)
        return AxisSolution(float(soft.x[0]), soft.status, iterations)


@dataclass(frozen=True, slots=True)
class AxisSolution:
    """Change of w over the plan's first step; None if no plan could be solved."""

    change: float | None
    status: str
    iterations: int
