"""The outer controllers over many vehicles; axes first: (3, vehicles).

The MPC's plans come of the flight's own matrices (`companion.control.qp`) as one product over all
vehicles.  The axes on which a plan violates a constraint go to the flight's own solvers one by one,
and a vehicle for which these fail to the flight's `Mpc.step`, fallbacks included, so that nothing
is approximated.
"""

from collections import deque
from collections.abc import Callable

import numpy as np

from companion.control.feedback import FeedbackController
from companion.control.interfaces import OuterController
from companion.control.mpc import Mpc, MpcMemory
from companion.control.qp.condensed import condense
from companion.control.qp.constrained import ConstrainedAxis, SoftBounds
from companion.control.qp.plan_map import APPLIED, BEFORE, POSITION, PREVIEW, VELOCITY, plan_map
from companion.control.qp.port import QpSolverFactory
from companion.control.reference_model import Array, PositionModel, discretise_position_model

Desired = Callable[[Array], Array]
"""Desired positions (3, …, vehicles), ENU m, at times (…, vehicles)."""

_TOLERANCE = 1e-6
_SOLVED = ("closed_form", "solved")


def make_outer(
    controller: OuterController, make_solver: QpSolverFactory, position_m: Array, delay_s: Array
) -> "PlanningLaw | FeedbackLaw":
    """The law of a stack, beginning at rest.

    Args:
        controller: of the stack.
        make_solver: of constrained problems.
        position_m: (3, vehicles).
        delay_s: (vehicles,) of the loop, as the companion measures it.
    """
    if isinstance(controller, Mpc):
        return PlanningLaw(controller, make_solver, position_m, delay_s)
    assert isinstance(controller, FeedbackController)
    return FeedbackLaw(controller, position_m.shape)


class FeedbackLaw:
    """`companion.control.feedback`, which takes arrays of any shape: no preview, no delay."""

    def __init__(self, controller: FeedbackController, shape: tuple[int, ...]) -> None:
        """Begin with an empty integral."""
        self._controller = controller
        self._memory = controller.start(np.zeros(shape[::-1]))
        self.period_s = controller.period_s
        nothing = np.zeros(shape[1], dtype=int)
        self.plans, self.constrained, self.at_r_max, self.failed = (nothing.copy() for _ in "pcrf")

    def step(
        self, time_s: float, position_m: Array, velocity_m_s: Array, desired: Desired, dt_s: float
    ) -> Array:
        """The reference r2 (3, vehicles); arguments as for `PlanningLaw.step`."""
        preview = desired(np.full((1, position_m.shape[1]), time_s))
        self._memory, r2, _ = self._controller.step(
            self._memory, position_m.T, velocity_m_s.T, preview.transpose(1, 2, 0), dt_s
        )
        return r2.T


class PlanningLaw:
    """`companion.control.mpc` with the state carried over each vehicle's delay."""

    def __init__(
        self, mpc: Mpc, make_solver: QpSolverFactory, position_m: Array, delay_s: Array
    ) -> None:
        """Begin with a reference at the positions; arguments as for `make_outer`."""
        settings, model = mpc.settings, mpc.settings.model
        n, count = settings.horizon + 1, position_m.shape[1]
        a, b = discretise_position_model(
            np.array(model.m), np.array(model.gain_k), settings.period_s
        )
        problems = [
            condense(*axis, settings.horizon, settings.weights) for axis in zip(a, b, strict=True)
        ]
        maps = [plan_map(p, penalise_absolute_r=settings.penalise_absolute_r) for p in problems]
        self._rows = np.stack([m.rows for m in maps])
        self._relative = maps[0].relative
        second_limit = settings.r_max_m_s2 * settings.period_s**2
        self._axes = [ConstrainedAxis(p, second_limit, make_solver) for p in problems]
        second = np.full((3, n), second_limit)
        speed = np.repeat(np.array(settings.velocity_limit_m_s)[:, None], n, axis=1)
        box = [np.repeat(np.array(end)[:, None], n, axis=1) for end in (
            settings.box_low_m, settings.box_high_m)]  # fmt: skip
        self._low = (np.hstack([box[0], -speed, -second]) - _TOLERANCE)[:, :, None]
        self._high = (np.hstack([box[1], speed, second]) + _TOLERANCE)[:, :, None]
        self._mpc, self._n, self._delay_s = mpc, n, delay_s
        self._carry = _Carry(model, position_m, delay_s)
        self.period_s = settings.period_s
        self._applied = position_m.copy()
        self._before = position_m.copy()
        self._plan = np.repeat(position_m[:, None], n, axis=1)
        self._failures = np.zeros(count, dtype=int)
        self.plans, self.constrained, self.at_r_max, self.failed = (
            np.zeros(count, dtype=int) for _ in "pcrf"
        )
        self.lost = np.zeros(count, dtype=bool)
        """For whom no solver is troubled."""

    def step(
        self, time_s: float, position_m: Array, velocity_m_s: Array, desired: Desired, dt_s: float
    ) -> Array:
        """The reference r2 (3, vehicles).

        Args:
            time_s: of the sample.
            position_m: as measured.
            velocity_m_s: as measured.
            desired: the reference.
            dt_s: since the last run.
        """
        position, velocity = self._carry.step(time_s, position_m, velocity_m_s)
        acts_s = time_s + self._delay_s
        preview = desired(self._mpc.preview_times_s[:, None] + acts_s)
        data = np.empty((3, PREVIEW + self._n + 1, position_m.shape[1]))
        data[:, POSITION], data[:, VELOCITY] = position, velocity
        data[:, APPLIED], data[:, BEFORE] = self._applied, self._before
        data[:, PREVIEW:] = preview
        rows = self._rows @ data
        led = rows[:, self._n :]
        outside = (led < self._low) | (led > self._high)
        plan, first = rows[:, : self._n], rows[:, 0].copy()
        self.plans += ~self.lost
        self.at_r_max += outside[:, 2 * self._n :].any(axis=(0, 1)) & ~self.lost
        axes = outside.any(axis=1) & ~self.lost
        violated = axes.any(axis=0)
        self.constrained += violated
        self._failures[~violated] = 0
        which = np.flatnonzero(violated)
        each = np.ascontiguousarray(data.transpose(2, 0, 1)[which])
        for k, own, asks in zip(which.tolist(), each, axes.T[which].tolist(), strict=True):
            first[:, k] = self._solved(k, own, asks, plan)
        self._plan = plan
        self._before, self._applied = self._applied, first
        self._carry.remember(time_s, first)
        return first

    def _solved(self, k: int, data: Array, asks: list[bool], plan: Array) -> Array:
        """A vehicle's reference where some axes ask for a solver; its plan becomes that one's."""
        settings = self._mpc.settings
        for i, asked in enumerate(asks):
            if not asked:
                continue
            centre, applied, before = (float(data[i, at]) for at in (PREVIEW, APPLIED, BEFORE))
            bounds = SoftBounds(
                settings.velocity_limit_m_s[i],
                settings.box_low_m[i] - centre,
                settings.box_high_m[i] - centre,
            )
            relative = self._relative.dot(data[i])
            found = self._axes[i].solve(relative, applied - centre, before - centre, bounds).plan
            if found is None:
                return self._fallback(k, data, plan)
            plan[i, :, k] = found + centre
        self._failures[k] = 0
        first: Array = plan[:, 0, k]
        return first

    def _fallback(self, k: int, data: Array, plan: Array) -> Array:
        """What the flight's controller does for a vehicle whose problem could not be solved."""
        memory = MpcMemory(
            self._applied[:, k], self._before[:, k], self._plan[:, :, k].T, int(self._failures[k])
        )
        memory, r2, record = self._mpc.step(
            memory, data[:, POSITION], data[:, VELOCITY], data[:, PREVIEW:].T
        )
        self._failures[k] = memory.failures
        self.failed[k] += record.status not in _SOLVED
        plan[:, :, k] = memory.plan_m.T
        return r2


class _Carry:
    """`companion.control.delay.carry` where each vehicle has its own delay."""

    def __init__(self, model: PositionModel, r2_m: Array, delay_s: Array) -> None:
        m, gain_k = np.array(model.m), np.array(model.gain_k)
        longest_ms = round(float(delay_s.max()) * 1e3) + 1
        steps = [discretise_position_model(m, gain_k, ms * 1e-3) for ms in range(longest_ms + 1)]
        a = np.stack([step[0] for step in steps], axis=-1)
        b = np.stack([step[1] for step in steps], axis=-1)
        self._table = (
            *(a[:, i, j] for i in range(2) for j in range(2)),
            *(b[:, i] for i in range(2)),
        )
        self._delay_s = delay_s
        self._longest_s = float(delay_s.max())
        self._applied: deque[tuple[float, Array]] = deque([(-np.inf, r2_m.copy())])

    def remember(self, decided_s: float, r2_m: Array) -> None:
        """A reference, which each vehicle sees a delay later."""
        self._applied.append((decided_s, r2_m))
        while len(self._applied) > 1 and self._applied[1][0] + self._longest_s < decided_s:
            self._applied.popleft()

    def step(self, sample_s: float, position_m: Array, velocity_m_s: Array) -> tuple[Array, Array]:
        """The state when what is decided on this sample acts."""
        now = np.full_like(self._delay_s, sample_s)
        until = sample_s + self._delay_s
        position, velocity = position_m, velocity_m_s
        for k, (_, r2) in enumerate(self._applied):
            end = until
            if k + 1 < len(self._applied):
                end = np.minimum(self._applied[k + 1][0] + self._delay_s, until)
            span_ms = np.maximum(np.round((end - now) * 1e3), 0.0).astype(int)
            if not span_ms.any():
                continue
            a11, a12, a21, a22, b1, b2 = (entry[:, span_ms] for entry in self._table)
            position, velocity = (
                a11 * position + a12 * velocity + b1 * r2,
                a21 * position + a22 * velocity + b2 * r2,
            )
            now = now + span_ms * 1e-3
        return position, velocity
