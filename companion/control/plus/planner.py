"""The preview MPC of MPC-L1+: how quickly u leaves or nears the flat input u*.

Where no constraint is in sight the optimum is a feedback (`feedback.py`), evaluated at every
sample.  Every plan's step the horizon is looked at; on axes on which the feedback would leave a
bound the constrained problem (`constrained.py`) decides, and what it decides holds until the next
look.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.control.interfaces import OuterRecord
from companion.control.mpc import MpcRecord, MpcStatus
from companion.control.plus import flatness
from companion.control.plus.constrained import AxisPlan, Bounds, Flat, Horizon
from companion.control.plus.feedback import FeedbackSettings, feedback
from companion.control.plus.nominal_plant import NominalPlant
from companion.control.qp.port import QpSolverFactory
from companion.control.reference_model import Array
from companion.frames import Vector3

_SCALES = tuple(round(0.6 + 0.1 * k, 1) for k in range(17))
"""Of the attitude's lag, for which feedbacks are kept ready."""
_PLANNED_SCALES = (0.7, 1.0, 1.4, 2.0)
"""The same for constrained problems, which are costly to set up."""
_FINE = 2
"""Samples of the preview per step of the plan."""


@dataclass(frozen=True, slots=True)
class PlannerLimits:
    """What a plan must keep."""

    horizontal_m_s2: float
    """Of the vector of the horizontal accelerations: by the tilt's limit.  Hard."""
    horizontal_rate_m_s3: float
    """Of each of their rates: by the tilt rate's limit.  Hard."""
    vertical_low: float
    """Of the vertical input, hard."""
    vertical_high: float
    speed_m_s: tuple[float, float, float]
    """Soft."""
    box_low_m: Vector3
    """Geofence, about the anchor.  Soft."""
    box_high_m: Vector3


@dataclass(frozen=True, slots=True)
class PlannerMemory:
    """What the planner carries from sample to sample."""

    due_s: float
    """Autopilot's time of the next look at the horizon."""
    planned_rate: tuple[float, float, float]
    """w' until then, by axis; NaN where the feedback decides."""


class Planner:
    """Feedbacks and problems, set up once.  Its only side effect is the solvers' warm start."""

    def __init__(
        self,
        settings: FeedbackSettings,
        plant: NominalPlant,
        horizon: Horizon,
        limits: PlannerLimits,
        quadratic_drag_1_m: float,
        make_solver: QpSolverFactory,
    ) -> None:
        """Solve the Riccati equations and set the solvers up.

        Raises:
            ValueError: a Riccati equation has no stabilising solution.
        """
        self.horizon = horizon
        self.limits = limits
        self._quadratic_drag_1_m = quadratic_drag_1_m
        self._fine_s = horizon.step_s / _FINE
        around = flatness.AROUND
        steps = np.arange(-around, _FINE * horizon.steps + around + 1, dtype=np.float64)
        self._times_s: Array = steps * self._fine_s
        self._times_s.setflags(write=False)
        self._gains = [feedback(settings, plant.lagging(scale)) for scale in _SCALES]
        vertical = AxisPlan(settings, plant, 2, horizon, make_solver)
        self._plans: list[tuple[AxisPlan, AxisPlan, AxisPlan]] = []
        for scale in _PLANNED_SCALES:
            slower = plant.lagging(scale)
            x, y = (AxisPlan(settings, slower, i, horizon, make_solver) for i in range(2))
            self._plans.append((x, y, vertical))

    def rate(self, start: Array, scale: float) -> Array:
        """The rate w' (3,) by the feedback, for a start (3, 5) and a lag."""
        place = (scale - _SCALES[0]) / (_SCALES[1] - _SCALES[0])
        low = max(0, min(len(_SCALES) - 2, math.floor(place)))
        share = min(1.0, max(0.0, place - low))
        gain = (1.0 - share) * self._gains[low] + share * self._gains[low + 1]
        rate: Array = -(gain * start).sum(axis=1)
        return rate

    def preview_times_s(self) -> Array:
        """From the time at which the input acts, for `look`."""
        return self._times_s

    def present_times_s(self) -> Array:
        """The first of `preview_times_s`: as many as `flat_now` needs."""
        return self._times_s[: 2 * flatness.AROUND + 1]

    def flat_now(
        self, plant: NominalPlant, present_m: Array, sigma: Array
    ) -> tuple[Array, Vector3]:
        """See `flatness.flat_at`, for positions at `present_times_s`."""
        return flatness.flat_at(plant, present_m, self._fine_s, sigma, self._quadratic_drag_1_m)

    def look(
        self,
        start: Array,
        plant: NominalPlant,
        scale: float,
        sigma: Array,
        preview_m: Array,
        anchor_m: Vector3,
    ) -> tuple[tuple[float, float, float], OuterRecord]:
        """Look at the horizon.

        Args:
            start: (3, 5) deviation of the state, and w.
            plant: with what was learnt.
            scale: of its lag.
            sigma: (3,) that the input cancels.
            preview_m: (k, 3) desired positions at `preview_times_s`.
            anchor_m: what the geofence lies about.

        Returns:
            w' by axis until the next look, NaN where the feedback decides; and the record.  Its
            status is `clipped_closed_form` when an axis could not be solved: there the feedback
            decides, and the limits after it clip.
        """
        states, inputs = flatness.flat(
            plant, preview_m, self._fine_s, sigma, self._quadratic_drag_1_m
        )
        nearest = min(range(len(_PLANNED_SCALES)), key=lambda k: abs(_PLANNED_SCALES[k] - scale))
        plans = self._plans[nearest]
        flats = [
            Flat(inputs[:-1:_FINE, i], states[_FINE::_FINE, i, 0], states[_FINE::_FINE, i, 1])
            for i in range(3)
        ]
        bounds = self._bounds(flats, anchor_m)
        rates, constrained, said, iterations = [math.nan] * 3, [False] * 3, [], 0
        failed = False
        ways = np.empty((self.horizon.steps, 3))
        for i, plan in enumerate(plans):
            violated, ways[:, i] = plan.violated(start[i], flats[i], bounds[i])
            if not violated:
                continue
            constrained[i] = True
            solution = plan.solve(start[i], flats[i], bounds[i])
            iterations += solution.iterations
            said.append(f"{'xyz'[i]}: {solution.status}")
            if solution.change is None:
                failed = True
            else:
                rates[i] = solution.change / self.horizon.step_s
        status: MpcStatus = "closed_form"
        if failed:
            status = "clipped_closed_form"
        elif any(constrained):
            status = "solved"
        record = MpcRecord(
            status=status,
            constrained_axes=tuple(constrained),
            r_max_active=False,
            solver_status=", ".join(said),
            iterations=iterations,
            predicted_position_m=ways,
        )
        return (rates[0], rates[1], rates[2]), record

    def _bounds(self, flats: list[Flat], anchor_m: Vector3) -> list[Bounds]:
        limits, n = self.limits, self.horizon.steps
        most = limits.horizontal_m_s2
        step = limits.horizontal_rate_m_s3 * self.horizon.step_s
        found = []
        for i in range(3):
            if i < 2:
                # What the other axis leaves of the vector, but never less than its equal share.
                other = np.minimum(np.abs(flats[1 - i].input), most)
                high = np.sqrt(np.maximum(0.5 * most * most, most * most - other * other))
                low, change = -high, step
            else:
                low = np.full(n, limits.vertical_low)
                high = np.full(n, limits.vertical_high)
                change = math.inf
            found.append(
                Bounds(
                    low,
                    high,
                    change if math.isfinite(change) else 1e6,
                    limits.speed_m_s[i],
                    limits.box_low_m[i] + anchor_m[i],
                    limits.box_high_m[i] + anchor_m[i],
                )
            )
        return found
