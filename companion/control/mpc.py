"""The paper's model predictive controller over the ideal reference system D(s).

Minimises, per axis and over N_h + 1 inputs,

``Σ q (y* - y)² + Σ r (r - y*)² + Σ s (r(k) - r(k-1))²``

subject to the discretised D(s), a hard bound on the second difference of the position reference
(the paper's ``|r̈| ≤ r_max``), and soft bounds on velocity and on a geofence box.  The paper puts
R on the absolute reference; `MpcSettings.penalise_absolute_r` selects that literal form, which
pulls the vehicle towards the origin.

The closed form is evaluated for all axes in one product; where it meets every constraint it *is*
the optimum.  Only axes that violate one go to the solver.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from companion.control.qp.condensed import AxisProblem, Weights, condense
from companion.control.qp.port import QpSolver, QpSolverFactory
from companion.control.reference_model import Array, discretise_position_model

MpcStatus = Literal["closed_form", "solved", "shifted_plan", "clipped_closed_form"]
"""How the reference came about; the last two are the fallbacks when a solve failed."""

_TOLERANCE = 1e-6
_SLACK_QUADRATIC = 1e3
_SLACK_LINEAR = 1e2


@dataclass(frozen=True, slots=True)
class MpcSettings:
    """Settings of the controller."""

    m: tuple[float, ...]
    """Bandwidths of M(s), as in the L1 controller below, 1/s."""
    gain_k: tuple[float, ...]
    """K of the L1 controller below, 1/s."""
    period_s: float
    horizon: int
    weights: Weights
    r_max_m_s2: float
    """Bound of the second difference of r over the period squared."""
    velocity_limit_m_s: tuple[float, ...]
    """Soft bound of |y1| per axis."""
    box_low_m: tuple[float, ...]
    """Soft lower bound of y2 per axis (geofence)."""
    box_high_m: tuple[float, ...]
    penalise_absolute_r: bool = False
    shifted_plans_at_most: int = 10
    """After this many failed solves in a row the shifted plan gives way to the closed form."""


@dataclass(frozen=True, slots=True)
class MpcMemory:
    """What the controller carries from tick to tick."""

    applied_r_m: Array
    """(axes,) the reference that was applied last, after a fallback too."""
    applied_r_before_m: Array
    """(axes,) the one before."""
    plan_m: Array
    """(N_h + 1, axes) the last plan, of which the first row was applied."""
    failures: int = 0
    """Solves that failed in a row."""


@dataclass(frozen=True, slots=True)
class MpcRecord:
    """Why the plan is what it is."""

    status: MpcStatus
    constrained_axes: tuple[bool, ...]
    """Axes on which the closed form violated a constraint."""
    r_max_active: bool
    """The bound on the second difference was among the violated ones."""
    solver_status: str
    iterations: int
    predicted_position_m: Array
    """(N_h + 1, axes): the positions that the plan leads to; empty after a failed solve."""


class Mpc:
    """The controller with its constant matrices.  `step` has no side effect but a warm start."""

    def __init__(self, settings: MpcSettings, make_solver: QpSolverFactory) -> None:
        """Condense the problem of each axis; the solvers are made when first needed.

        Raises:
            ValueError: lengths differ, or the cost is not positive definite.
        """
        axes = len(settings.m)
        per_axis = (
            settings.gain_k,
            settings.velocity_limit_m_s,
            settings.box_low_m,
            settings.box_high_m,
        )
        if any(len(values) != axes for values in per_axis):
            raise ValueError("m, K, velocity limits and box must have one value per axis")
        self.settings = settings
        a, b = discretise_position_model(
            np.array(settings.m), np.array(settings.gain_k), settings.period_s
        )
        self._problems = [
            condense(a[i], b[i], settings.horizon, settings.weights) for i in range(axes)
        ]
        self._gain = np.stack([p.gain for p in self._problems])
        self._position_from_state = np.stack([p.position_from_state for p in self._problems])
        self._position_from_r = np.stack([p.position_from_r for p in self._problems])
        self._velocity_from_state = np.stack([p.velocity_from_state for p in self._problems])
        self._velocity_from_r = np.stack([p.velocity_from_r for p in self._problems])
        self._second = self._problems[0].second_difference
        self._second_limit = settings.r_max_m_s2 * settings.period_s**2
        self._velocity_limit = np.array(settings.velocity_limit_m_s)[:, None]
        self._low = np.array(settings.box_low_m)
        self._high = np.array(settings.box_high_m)
        self._make_solver = make_solver
        self._solvers: list[QpSolver | None] = [None] * axes
        self._constraints = [_constraint_matrix(p) for p in self._problems]

    @property
    def preview_times_s(self) -> Array:
        """Offsets from k̄ at which `step` wants y*: k̄ … k̄+N_h+1, (N_h + 2,)."""
        times: Array = self.settings.period_s * np.arange(
            self.settings.horizon + 2, dtype=np.float64
        )
        return times

    def start(self, r_m: Array) -> MpcMemory:
        """Memory with which a reference r (axes,) continues without a bump."""
        r = np.array(r_m, dtype=float)
        return MpcMemory(r, r, np.tile(r, (self.settings.horizon + 1, 1)))

    def step(
        self, memory: MpcMemory, position_m: Array, velocity_m_s: Array, preview_m: Array
    ) -> tuple[MpcMemory, Array, MpcRecord]:
        """Plan from the state at k̄ and apply the first input, or the best that can be had.

        When a constrained axis can't be solved, the last plan is shifted by one; after
        `MpcSettings.shifted_plans_at_most` failures in a row the closed form takes over, clipped
        to the hard bound.

        Args:
            memory: the references applied before.
            position_m: (axes,) y2 at k̄.
            velocity_m_s: (axes,) y1 at k̄.
            preview_m: (N_h + 2, axes) y* at k̄ … k̄+N_h+1.

        Returns:
            The new memory, the reference to apply (axes,), and the record.
        """
        plan, record = self.plan(memory, position_m, velocity_m_s, preview_m)
        if plan is not None:
            return MpcMemory(plan[0], memory.applied_r_m, plan), plan[0], record
        failures = memory.failures + 1
        shifted = np.vstack([memory.plan_m[1:], memory.plan_m[-1:]])
        if failures <= self.settings.shifted_plans_at_most:
            status: MpcStatus = "shifted_plan"
            applied = shifted[0]
        else:
            status = "clipped_closed_form"
            applied = self._closed_form_clipped(memory, position_m, velocity_m_s, preview_m)
        advanced = MpcMemory(applied, memory.applied_r_m, shifted, failures)
        return advanced, applied, replace(record, status=status)

    def plan(
        self, memory: MpcMemory, position_m: Array, velocity_m_s: Array, preview_m: Array
    ) -> tuple[Array | None, MpcRecord]:
        """Solve the optimisation problem; arguments as for `step`.

        Returns:
            The plan (N_h + 1, axes), or None if a constrained axis could not be solved, and the
            record.
        """
        n = self.settings.horizon + 1
        centre = preview_m[0]
        desired = (preview_m - centre).T
        previous = memory.applied_r_m - centre
        before = memory.applied_r_before_m - centre
        axes = len(centre)
        data = np.empty((axes, 3 + 2 * n))
        data[:, 0] = position_m - centre
        data[:, 1] = velocity_m_s
        data[:, 2] = previous
        data[:, 3 : 3 + n] = desired[:, 1:]
        data[:, 3 + n :] = -centre[:, None] if self.settings.penalise_absolute_r else desired[:, :n]
        plan = (self._gain @ data[:, :, None])[:, :, 0]

        second = plan @ self._second.T
        second[:, 0] += before - 2.0 * previous
        second[:, 1] += previous
        state = data[:, :2, None]
        position = (self._position_from_state @ state)[:, :, 0]
        position += (self._position_from_r @ plan[:, :, None])[:, :, 0]
        velocity = (self._velocity_from_state @ state)[:, :, 0]
        velocity += (self._velocity_from_r @ plan[:, :, None])[:, :, 0]
        low, high = self._low - centre, self._high - centre
        over_second = np.abs(second).max(axis=1) > self._second_limit + _TOLERANCE
        violated = (
            over_second
            | (np.abs(velocity) > self._velocity_limit + _TOLERANCE).any(axis=1)
            | (position.min(axis=1) < low - _TOLERANCE)
            | (position.max(axis=1) > high + _TOLERANCE)
        )
        constrained = tuple(bool(v) for v in violated)
        r_max_active = bool(over_second.any())
        if not any(constrained):
            record = MpcRecord(
                "closed_form", constrained, False, "", 0, (position + centre[:, None]).T
            )
            return plan.T + centre, record
        iterations, status = 0, ""
        for i in np.flatnonzero(violated):
            bounds = (float(low[i]), float(high[i]))
            past = (float(previous[i]), float(before[i]))
            solution = self._solve_axis(int(i), data[i], past, bounds)
            iterations += solution[1]
            status = solution[2]
            if solution[0] is None:
                empty = np.empty((0, axes))
                record = MpcRecord(
                    "shifted_plan", constrained, r_max_active, status, iterations, empty
                )
                return None, record
            plan[i] = solution[0]
        position = (self._position_from_state @ state + self._position_from_r @ plan[:, :, None])[
            :, :, 0
        ]
        record = MpcRecord(
            "solved", constrained, r_max_active, status, iterations, (position + centre[:, None]).T
        )
        return plan.T + centre, record

    def _closed_form_clipped(
        self, memory: MpcMemory, position_m: Array, velocity_m_s: Array, preview_m: Array
    ) -> Array:
        """First input (axes,) of the unconstrained optimum, clipped to the hard bound."""
        n = self.settings.horizon + 1
        centre = preview_m[0]
        desired = (preview_m - centre).T
        state = np.stack([position_m - centre, velocity_m_s, memory.applied_r_m - centre], axis=1)
        target = desired[:, :n]
        if self.settings.penalise_absolute_r:
            target = np.broadcast_to(-centre[:, None], target.shape)
        data = np.concatenate([state, desired[:, 1:], target], axis=1)
        first = (self._gain[:, 0, :] * data).sum(axis=1) + centre
        straight = 2.0 * memory.applied_r_m - memory.applied_r_before_m
        clipped: Array = np.clip(
            first, straight - self._second_limit, straight + self._second_limit
        )
        return clipped

    def _solve_axis(
        self, axis: int, data: Array, past: tuple[float, float], box_m: tuple[float, float]
    ) -> tuple[Array | None, int, str]:
        problem = self._problems[axis]
        n = self.settings.horizon + 1
        solver = self._solvers[axis]
        if solver is None:
            solver = self._make_solver(*_with_slacks(problem, self._constraints[axis]))
            self._solvers[axis] = solver
        gradient = np.concatenate([problem.gradient @ data, np.full(2, _SLACK_LINEAR)])
        previous, before = past
        offset = np.zeros(n)
        offset[0] = before - 2.0 * previous
        offset[1] += previous
        limit = self._second_limit
        free_velocity = problem.velocity_from_state @ data[:2]
        free_position = problem.position_from_state @ data[:2]
        speed = float(self._velocity_limit[axis, 0])
        low, high = box_m
        unbounded = np.full(n, np.inf)
        lower = np.concatenate(
            [
                -limit - offset,
                -unbounded,
                -speed - free_velocity,
                -unbounded,
                low - free_position,
                [0, 0],
            ]
        )
        upper = np.concatenate(
            [
                limit - offset,
                speed - free_velocity,
                unbounded,
                high - free_position,
                unbounded,
                unbounded[:2],
            ]
        )
        solution = solver.solve(gradient, lower, upper)
        if solution.x is None:
            return None, solution.iterations, solution.status
        return solution.x[:n], solution.iterations, solution.status


def _constraint_matrix(problem: AxisProblem) -> Array:
    """Rows: second differences; ± velocities with their slack; ± positions with theirs; slacks."""
    n = problem.hessian.shape[0]
    zero, one = np.zeros((n, 1)), np.ones((n, 1))
    velocity, position = problem.velocity_from_r, problem.position_from_r
    return np.vstack(
        [
            np.hstack([problem.second_difference, zero, zero]),
            np.hstack([velocity, -one, zero]),
            np.hstack([velocity, one, zero]),
            np.hstack([position, zero, -one]),
            np.hstack([position, zero, one]),
            np.hstack([np.zeros((2, n)), np.eye(2)]),
        ]
    )


def _with_slacks(problem: AxisProblem, constraints: Array) -> tuple[Array, Array]:
    n = problem.hessian.shape[0]
    hessian = np.zeros((n + 2, n + 2))
    hessian[:n, :n] = problem.hessian
    hessian[n:, n:] = _SLACK_QUADRATIC * np.eye(2)
    return hessian, constraints
