"""The preview MPC where a bound is in the way."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.plus.constrained import AxisPlan, Bounds, Flat, Horizon
from companion.control.plus.feedback import FeedbackSettings, feedback
from companion.control.plus.nominal_plant import discrete
from companion.control.qp.daqp_solver import DaqpSolver
from companion.control.qp.osqp_solver import OsqpSolver
from companion.control.qp.port import QpSolution
from tests.companion.control.plus.examples import CLIMBING, THRUSTING, vectors

STEP_S = 0.04
STEPS = 25
HORIZON = Horizon(STEP_S, STEPS)
FAR = 1e3
SETTINGS = FeedbackSettings((5.0, 5.0, 4.0), (0.05, 0.05, 0.05), STEP_S)
STIFF = FeedbackSettings((9.5, 9.5, 8.0), (0.05, 0.05, 0.05), STEP_S)
CASES = [(THRUSTING, 0), (THRUSTING, 2), (CLIMBING, 2)]
AXES = pytest.mark.parametrize(("plant", "axis"), CASES, ids=["tilt", "thrust", "climb rate"])


class Remembering:
    """A solver that keeps the rows of the last problem at its solution."""

    def __init__(self, p, a):
        self._solver = OsqpSolver(p, a)
        self._rows = a
        self.last = None

    def solve(self, q, lower, upper):
        solution = self._solver.solve(q, lower, upper)
        self.last = None if solution.x is None else self._rows @ solution.x
        return solution


class Failing:
    """A solver that finds nothing."""

    def __init__(self, p, a):
        pass

    def solve(self, q, lower, upper):
        return QpSolution(None, "out of luck", 7)


def plan_of(plant, axis, factory=OsqpSolver, weights=SETTINGS):
    return AxisPlan(weights, plant, axis, HORIZON, factory)


def flat(position=0.0, velocity=0.0, u=0.0):
    ahead = STEP_S * np.arange(1, STEPS + 1)
    return Flat(np.full(STEPS, u), position + velocity * ahead, np.full(STEPS, velocity))


def bounds(u=FAR, step=FAR, speed=FAR, low=-FAR, high=FAR):
    return Bounds(np.full(STEPS, -u), np.full(STEPS, u), step, speed, low, high)


def receding(plant, axis, start, limits, steps, target=0.0, weights=SETTINGS, factory=OsqpSolver):
    """The vehicle under the first step of plan after plan: states (steps + 1, 5).

    Args:
        plant: also that of the vehicle.
        axis: of it.
        start: (5,) deviation and w.
        limits: for every plan.
        steps: how many plans.
        target: where the flat position stays, m; the states are given relative to it.
        weights: of the plans.
        factory: of the solvers.
    """
    plan, (a, b) = plan_of(plant, axis, factory, weights), discrete(plant, round(STEP_S * 1e6))
    x, found = np.array(start, dtype=float), [np.array(start, dtype=float)]
    there = flat(target)
    for _ in range(steps):
        solution = plan.solve(x, there, limits)
        assert solution.change is not None
        w = x[4] + solution.change
        x = np.append(a[axis] @ x[:4] + b[axis, :, 0] * w, w)
        found.append(x)
    return np.array(found)


@AXES
@settings(deadline=None, derandomize=True, max_examples=8)
@given(start=vectors(0.8, 5))
def test_with_the_bounds_out_of_sight_it_is_the_feedback(plant, axis, start):
    gains = feedback(SETTINGS, plant)[axis]
    solution = plan_of(plant, axis).solve(start, flat(), bounds())
    assert solution.change == pytest.approx(-float(gains @ start) * STEP_S, rel=1e-3, abs=1e-3)
    assert solution.status == "solved"


@AXES
@settings(deadline=None, derandomize=True, max_examples=8)
@given(start=vectors(0.8, 5))
def test_it_is_seen_beforehand_where_the_feedback_leads(plant, axis, start):
    """The foreseen positions are those of the closed loop, step by step."""
    gains = feedback(SETTINGS, plant)[axis]
    a, b = discrete(plant, round(STEP_S * 1e6))
    violated, positions = plan_of(plant, axis).violated(start, flat(2.0), bounds())
    assert not violated
    x = start
    for position in positions:
        w = x[4] - STEP_S * float(gains @ x)
        x = np.append(a[axis] @ x[:4] + b[axis, :, 0] * w, w)
        assert position == pytest.approx(2.0 + x[0], abs=1e-9)


@AXES
@pytest.mark.parametrize(
    "limits",
    [
        bounds(u=0.5),
        bounds(step=0.05),
        bounds(speed=0.1),
        bounds(low=-0.5),
        bounds(high=0.2),
    ],
    ids=["input", "its rate", "speed", "from below", "from above"],
)
def test_each_bound_is_seen_where_the_feedback_would_leave_it(plant, axis, limits):
    plan = plan_of(plant, axis)
    still = np.zeros(5)
    assert not plan.violated(still, flat(), limits)[0]
    away = np.array([1.0 if limits.low_m == -FAR else -1.0, 0.0, 0.0, 0.0, 0.0])
    assert plan.violated(away, flat(), limits)[0]
    assert not plan.violated(away, flat(), bounds())[0]


@AXES
@settings(deadline=None, derandomize=True, max_examples=8)
@given(offset=st.floats(-4.0, 4.0), speed=st.floats(-1.5, 1.5), u=st.floats(-0.5, 0.5))
def test_hard_bounds_are_kept_all_along_the_plan(plant, axis, offset, speed, u):
    made = []

    def factory(p, a):
        made.append(Remembering(p, a))
        return made[-1]

    plan = plan_of(plant, axis, factory)
    limits, there = bounds(u=1.5, step=0.2), flat(u=u)
    start = np.array([offset, speed, 0.0, 0.0, 0.0])
    solution = plan.solve(start, there, limits)
    assert solution.change is not None
    first, second = made[0].last[:STEPS], made[0].last[STEPS:]
    inputs, changes = u + first, second
    assert np.cumsum(changes) == pytest.approx(first, abs=1e-6)
    assert np.abs(inputs).max() <= 1.5 + 1e-3
    assert np.abs(changes).max() <= 0.2 + 1e-3
    assert solution.change == pytest.approx(changes[0])


@settings(deadline=None, derandomize=True, max_examples=8)
@given(st.floats(1.6, 4.0), st.sampled_from([-1.0, 1.0]))
def test_an_input_beyond_its_bound_comes_back_as_quickly_as_its_rate_allows(start, sign):
    limits = bounds(u=1.5, step=0.2)
    away = np.array([0.0, 0.0, 0.0, 0.0, sign * start])
    flown = receding(THRUSTING, 0, away, limits, 20)
    w = sign * flown[:, 4]
    assert (np.abs(np.diff(w)) <= 0.2 + 1e-3).all()
    needed = int(np.ceil((start - 1.5) / 0.2))
    assert (w[needed:] <= 1.5 + 2e-3).all()


@AXES
def test_the_speed_is_softly_kept_on_the_way_back_from_afar(plant, axis):
    start = [-5.0, 0.0, 0.0, 0.0, 0.0]
    slow = receding(plant, axis, start, bounds(u=3.0, speed=1.0), 170)
    quick = receding(plant, axis, start, bounds(u=3.0), 170)
    assert slow[:, 1].max() < 1.08
    assert quick[:, 1].max() > 1.5
    assert abs(slow[-1, 0]) < 0.02


@AXES
@pytest.mark.parametrize("weights", [SETTINGS, STIFF], ids=["soft", "stiff"])
def test_a_box_is_softly_kept_where_the_trajectory_lies_outside(plant, axis, weights):
    """The flat position is 1 m beyond the box's end at 2 m."""
    start, limits = [-2.0, 0.0, 0.0, 0.0, 0.0], bounds(u=6.0, high=2.0)
    flown = receding(plant, axis, start, limits, 150, 3.0, weights)
    positions = 3.0 + flown[:, 0]
    assert positions.max() < 2.1
    assert positions[-1] == pytest.approx(2.0, abs=0.1)


@AXES
@settings(deadline=None, derandomize=True, max_examples=6)
@given(beyond=st.floats(0.1, 2.0), speed=st.floats(0.0, 2.5))
def test_from_outside_of_every_soft_bound_it_comes_back(plant, axis, beyond, speed):
    comes_back(plant, axis, beyond, speed, DaqpSolver)


@AXES
@pytest.mark.parametrize(("beyond", "speed"), [(0.1, 0.0), (1.0, 1.25), (2.0, 2.5)])
def test_with_osqp_it_comes_back_from_most_places(plant, axis, beyond, speed):
    """From 1.6 m outside at 2 m/s it runs into its limit of iterations, which is told."""
    comes_back(plant, axis, beyond, speed, OsqpSolver)


def comes_back(plant, axis, beyond, speed, factory):
    limits = bounds(u=3.0, speed=1.0, low=-1.0, high=1.0)
    start = [1.0 + beyond, speed, 0.0, 0.0, 0.0]
    flown = receding(plant, axis, start, limits, 150, factory=factory)
    assert abs(flown[-1, 0]) < 0.05
    assert abs(flown[-1, 1]) < 0.05


@AXES
def test_a_solver_that_fails_gives_no_plan_and_says_why(plant, axis):
    solution = plan_of(plant, axis, Failing).solve(np.ones(5), flat(), bounds(u=0.1))
    assert solution.change is None
    assert solution.status == "out of luck"
    assert solution.iterations == 7


def test_where_only_the_soft_bounds_fail_the_hard_ones_are_still_kept():
    made = []

    def hard_only(p, a):
        made.append(p)
        return OsqpSolver(p, a) if len(made) == 1 else Failing(p, a)

    solution = plan_of(THRUSTING, 0, hard_only).solve(
        np.array([-5.0, 0.0, 0.0, 0.0, 0.0]), flat(), bounds(u=2.0, step=0.2, speed=0.3)
    )
    assert solution.change is not None
    assert abs(solution.change) <= 0.2 + 1e-3
    assert solution.status == "soft bounds dropped: out of luck"


def test_a_start_that_is_not_a_number_gives_no_plan():
    solution = plan_of(THRUSTING, 0).solve(np.full(5, np.nan), flat(), bounds())
    assert solution.change is None
