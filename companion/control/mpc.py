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

import copy
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from companion.control.qp.condensed import Weights, condense
from companion.control.qp.constrained import ConstrainedAxis, SoftBounds
from companion.control.qp.port import QpSolverFactory
from companion.control.reference_model import (
    Array,
    PositionModel,
    discretise_position_model,
)

MpcStatus = Literal["closed_form", "solved", "shifted_plan", "clipped_closed_form"]
"""How the reference came about; the last two are the fallbacks when a solve failed."""

_TOLERANCE = 1e-6
_AXES = "xyz"


@dataclass(frozen=True, slots=True)
class MpcSettings:
    """Settings of the controller."""

    model: PositionModel
    """D(s) of the L1 controller below, or what was identified of another one."""
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
    """The controller with its constant matrices.  Its only side effect is a solver's warm start."""

    def __init__(self, settings: MpcSettings, make_solver: QpSolverFactory) -> None:
        """Condense the problem of each axis.

        Raises:
            ValueError: lengths differ, or the cost is not positive definite.
        """
        axes = len(settings.model.m)
        per_axis = (
            settings.model.gain_k,
            settings.velocity_limit_m_s,
            settings.box_low_m,
            settings.box_high_m,
        )
        if any(len(values) != axes for values in per_axis):
            raise ValueError("m, K, velocity limits and box must have one value per axis")
        self.settings = settings
        a, b = discretise_position_model(
            np.array(settings.model.m), np.array(settings.model.gain_k), settings.period_s
        )
        problems = [condense(a[i], b[i], settings.horizon, settings.weights) for i in range(axes)]
        self._second_limit = settings.r_max_m_s2 * settings.period_s**2
        self._axes = [ConstrainedAxis(p, self._second_limit, make_solver) for p in problems]
        self._gain = np.stack([p.gain for p in problems])
        self._second = problems[0].second_difference
        # Position and velocity of one axis in one product: (axes, 2n, ·).
        self._outputs_from_state = np.stack(
            [np.vstack([p.position_from_state, p.velocity_from_state]) for p in problems]
        )
        self._outputs_from_r = np.stack(
            [np.vstack([p.position_from_r, p.velocity_from_r]) for p in problems]
        )
        self._speed = np.array(settings.velocity_limit_m_s)
        self._low = np.array(settings.box_low_m)
        self._high = np.array(settings.box_high_m)

    @property
    def period_s(self) -> float:
        """Time between two plans."""
        return self.settings.period_s

    @property
    def model(self) -> PositionModel:
        """What the plans predict with, and the state is carried over the delay by."""
        return self.settings.model

    @property
    def preview_times_s(self) -> Array:
        """Offsets from k̄ at which `step` wants y*: k̄ … k̄+N_h+1, (N_h + 2,)."""
        times: Array = self.settings.period_s * np.arange(
            self.settings.horizon + 2, dtype=np.float64
        )
        return times

    def about(self, anchor_m: Array) -> "Mpc":
        """The same controller with its box about a point (axes,); it shares the solvers."""
        moved = copy.copy(self)
        moved._low, moved._high = self._low + anchor_m, self._high + anchor_m
        moved.settings = replace(
            self.settings,
            box_low_m=tuple(moved._low.tolist()),
            box_high_m=tuple(moved._high.tolist()),
        )
        return moved

    def start(self, r_m: Array) -> MpcMemory:
        """Memory with which a reference r (axes,) continues without a bump."""
        r = np.array(r_m, dtype=float)
        return MpcMemory(r, r, np.tile(r, (self.settings.horizon + 1, 1)))

    def step(
        self,
        memory: MpcMemory,
        position_m: Array,
        velocity_m_s: Array,
        preview_m: Array,
        dt_s: float = 0.0,
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
            dt_s: since the last plan; of no use here, the model's step is the period.

        Returns:
            The new memory, the reference to apply (axes,), and the record.
        """
        plan, record = self.plan(memory, position_m, velocity_m_s, preview_m)
        if plan is not None:
            return MpcMemory(plan[0], memory.applied_r_m, plan), plan[0], record
        failures = memory.failures + 1
        shifted = np.vstack([memory.plan_m[1:], memory.plan_m[-1:]])
        if failures <= self.settings.shifted_plans_at_most:
            advanced = MpcMemory(shifted[0], memory.applied_r_m, shifted, failures)
            return advanced, shifted[0], record
        data = self._data(memory, position_m, velocity_m_s, preview_m)
        first = (self._gain[:, 0, :] * data).sum(axis=1) + preview_m[0]
        straight = 2.0 * memory.applied_r_m - memory.applied_r_before_m
        clipped = np.clip(first, straight - self._second_limit, straight + self._second_limit)
        advanced = MpcMemory(clipped, memory.applied_r_m, shifted, failures)
        return advanced, clipped, replace(record, status="clipped_closed_form")

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
        data = self._data(memory, position_m, velocity_m_s, preview_m)
        if not np.isfinite(data).all():
            nothing = np.empty((0, len(centre)))
            free = (False,) * len(centre)
            return None, MpcRecord("shifted_plan", free, False, "input not finite", 0, nothing)
        previous = data[:, 2]
        before = memory.applied_r_before_m - centre
        low, high = self._low - centre, self._high - centre
        plan = (self._gain @ data[:, :, None])[:, :, 0]
        outputs = self._outputs(data, plan)
        second = plan @ self._second.T
        second[:, 0] += before - 2.0 * previous
        second[:, 1] += previous
        over_second = np.abs(second).max(axis=1) > self._second_limit + _TOLERANCE
        violated = (
            over_second
            | (np.abs(outputs[:, n:]).max(axis=1) > self._speed + _TOLERANCE)
            | (outputs[:, :n].min(axis=1) < low - _TOLERANCE)
            | (outputs[:, :n].max(axis=1) > high + _TOLERANCE)
        )
        constrained = tuple(violated.tolist())
        status: MpcStatus = "closed_form"
        said: list[str] = []
        iterations = 0
        for i in np.flatnonzero(violated):
            bounds = SoftBounds(float(self._speed[i]), float(low[i]), float(high[i]))
            solution = self._axes[i].solve(data[i], float(previous[i]), float(before[i]), bounds)
            iterations += solution.iterations
            said.append(f"{_AXES[i]}: {solution.status}" if len(centre) == 3 else solution.status)
            if solution.plan is None:
                status = "shifted_plan"
                break
            plan[i] = solution.plan
            status = "solved"
        r_max_active = bool(over_second.any())
        solver_status = ", ".join(said)
        if status == "shifted_plan":
            empty = np.empty((0, len(centre)))
            record = MpcRecord(status, constrained, r_max_active, solver_status, iterations, empty)
            return None, record
        if status == "solved":
            outputs = self._outputs(data, plan)
        predicted = (outputs[:, :n] + centre[:, None]).T
        record = MpcRecord(status, constrained, r_max_active, solver_status, iterations, predicted)
        return plan.T + centre, record

    def _data(
        self, memory: MpcMemory, position_m: Array, velocity_m_s: Array, preview_m: Array
    ) -> Array:
        """What the optimum is linear in, per axis: x, r_prev, y* at the outputs, target of r."""
        n = self.settings.horizon + 1
        centre = preview_m[0]
        desired = (preview_m - centre).T
        data = np.empty((len(centre), 3 + 2 * n))
        data[:, 0] = position_m - centre
        data[:, 1] = velocity_m_s
        data[:, 2] = memory.applied_r_m - centre
        data[:, 3 : 3 + n] = desired[:, 1:]
        data[:, 3 + n :] = -centre[:, None] if self.settings.penalise_absolute_r else desired[:, :n]
        return data

    def _outputs(self, data: Array, plan: Array) -> Array:
        """Positions, then velocities, that a plan leads to, (axes, 2n)."""
        outputs = self._outputs_from_state @ data[:, :2, None]
        outputs += self._outputs_from_r @ plan[:, :, None]
        return outputs[:, :, 0]
