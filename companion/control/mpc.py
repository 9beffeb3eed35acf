"""The paper's model predictive controller over the ideal reference system D(s).

Minimises, per axis and over N_h + 1 inputs,

``Σ q (y* - y)² + Σ r (r - y*)² + Σ s (r(k) - r(k-1))²``

subject to the discretised D(s), a hard bound on the second difference of the position reference
(the paper's ``|r̈| ≤ r_max``), and soft bounds on velocity and on a geofence box.  The paper puts
R on the absolute reference; `MpcSettings.penalise_absolute_r` selects that literal form, which
pulls the vehicle towards the origin.

The closed form and all that it leads to are evaluated for all axes in one product
(`companion.control.qp.plan_map`); where it meets every constraint it *is* the optimum.  Only axes
that violate one go to the solver.
"""

import copy
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from companion.control.qp.condensed import Weights, condense
from companion.control.qp.constrained import ConstrainedAxis, SoftBounds
from companion.control.qp.plan_map import PREVIEW, PlanData, plan_map
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


# Two are made per tick, and frozen ones take four times as long: change none.
@dataclass(slots=True)
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


@dataclass(slots=True)
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
    """The controller with its constant matrices.

    Its only side effect is a solver's warm start: what it keeps in place of new arrays is
    overwritten at each plan, and nothing that it returns shares it.
    """

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
        a, b = discretise_position_model(
            np.array(settings.model.m), np.array(settings.model.gain_k), settings.period_s
        )
        problems = [condense(a[i], b[i], settings.horizon, settings.weights) for i in range(axes)]
        maps = [plan_map(p, penalise_absolute_r=settings.penalise_absolute_r) for p in problems]
        self._second_limit = settings.r_max_m_s2 * settings.period_s**2
        self._axes = [ConstrainedAxis(p, self._second_limit, make_solver) for p in problems]
        self._relative = maps[0].relative
        self._rows = np.stack([m.rows for m in maps])
        self._n = settings.horizon + 1
        self._unbound = (False,) * axes
        self._data = PlanData(axes, settings.horizon + 2)
        self._above, self._below = np.empty((2, axes, 4 * self._n, 1), dtype=bool)
        self._all_kept = np.ones_like(self._above).tobytes()
        self._times_s: Array = settings.period_s * np.arange(settings.horizon + 2, dtype=np.float64)
        self._times_s.setflags(write=False)
        self._bind(settings)

    def _bind(self, settings: MpcSettings) -> None:
        """Take the settings, of which bounds alone may differ from those before."""
        self.settings = settings
        n = settings.horizon + 1
        speed = np.array(settings.velocity_limit_m_s)[:, None]
        second = np.full_like(speed, self._second_limit)
        low, high = np.array(settings.box_low_m)[:, None], np.array(settings.box_high_m)[:, None]
        none = np.full_like(speed, np.inf)
        # Of plan, positions, velocities and second differences, as they follow in `PlanMap.rows`.
        lows = np.hstack([-none, low, -speed, -second])
        highs = np.hstack([none, high, speed, second])
        self._low = np.repeat(lows, n, axis=1)[:, :, None] - _TOLERANCE
        self._high = np.repeat(highs, n, axis=1)[:, :, None] + _TOLERANCE

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
        return self._times_s

    def about(self, anchor_m: Array) -> "Mpc":
        """The same controller with its box about a point (axes,); it shares the solvers."""
        moved = copy.copy(self)
        moved._bind(
            replace(
                self.settings,
                box_low_m=tuple((np.array(self.settings.box_low_m) + anchor_m).tolist()),
                box_high_m=tuple((np.array(self.settings.box_high_m) + anchor_m).tolist()),
            )
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
            first = plan[0]
            return MpcMemory(first, memory.applied_r_m, plan), first, record
        failures = memory.failures + 1
        shifted = np.vstack([memory.plan_m[1:], memory.plan_m[-1:]])
        if failures <= self.settings.shifted_plans_at_most:
            advanced = MpcMemory(shifted[0], memory.applied_r_m, shifted, failures)
            return advanced, shifted[0], record
        free = (self._rows[:, 0, :] * self._data.all).sum(axis=1)  # of the plan that failed
        straight = 2.0 * memory.applied_r_m - memory.applied_r_before_m
        clipped = np.clip(free, straight - self._second_limit, straight + self._second_limit)
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
        data = self._data
        data.position[...] = position_m
        data.velocity[...] = velocity_m_s
        data.applied[...] = memory.applied_r_m
        data.before[...] = memory.applied_r_before_m
        data.preview[...] = preview_m
        rows = np.matmul(self._rows, data.columns)
        # Nothing that is not finite is within bounds.
        np.less_equal(self._low, rows, self._above)
        np.less_equal(rows, self._high, self._below)
        if self._above.tobytes() == self._all_kept == self._below.tobytes():
            led = rows.T[0]
            n = self._n
            return led[:n], MpcRecord("closed_form", self._unbound, False, "", 0, led[n : 2 * n])
        if not data.finite():
            return None, _unsolved(self._unbound, False, "input not finite", 0)
        np.logical_and(self._above, self._below, self._above)
        return self._constrained(rows[:, :, 0], self._above.tobytes())

    def _constrained(self, rows: Array, kept: bytes) -> tuple[Array | None, MpcRecord]:
        """Solve the axes on which the closed form violates something, in the place of its rows.

        Args:
            rows: (axes, 4n) of the closed form.
            kept: a byte for each of them, 0 where it violates a bound.
        """
        n, settings = self._n, self.settings
        by_axis = [kept[at : at + 4 * n] for at in range(0, len(kept), 4 * n)]
        constrained = tuple([0 in one for one in by_axis])
        r_max_active = 0 in b"".join([one[3 * n :] for one in by_axis])
        said: list[str] = []
        iterations = 0
        for i, violated in enumerate(constrained):
            if not violated:
                continue
            data = self._data.all[i]
            row = rows[i]
            _, _, applied, before, centre = data[: PREVIEW + 1].tolist()
            bounds = SoftBounds(
                settings.velocity_limit_m_s[i],
                settings.box_low_m[i] - centre,
                settings.box_high_m[i] - centre,
            )
            solution = self._axes[i].solve(
                self._relative.dot(data), applied - centre, before - centre, bounds
            )
            iterations += solution.iterations
            said.append(f"{_AXES[i]}: {solution.status}" if len(rows) == 3 else solution.status)
            if solution.plan is None or solution.position is None:
                return None, _unsolved(constrained, r_max_active, ", ".join(said), iterations)
            np.add(solution.plan, centre, row[:n])
            np.add(solution.position, centre, row[n : 2 * n])
        led = rows.T
        record = MpcRecord(
            "solved", constrained, r_max_active, ", ".join(said), iterations, led[n : 2 * n]
        )
        return led[:n], record


def _unsolved(
    constrained: tuple[bool, ...], r_max_active: bool, solver_status: str, iterations: int
) -> MpcRecord:
    nothing = np.empty((0, len(constrained)))
    return MpcRecord("shifted_plan", constrained, r_max_active, solver_status, iterations, nothing)
