"""What decides the rate of the input: the feedback, or where it would leave a bound, the plan."""

import math

import numpy as np
import pytest

from companion.control.plus.constrained import Horizon
from companion.control.plus.feedback import FeedbackSettings, feedback
from companion.control.plus.planner import Planner, PlannerLimits
from companion.control.qp.osqp_solver import OsqpSolver
from tests.companion.control.plus.examples import THRUSTING

SETTINGS = FeedbackSettings((5.0, 5.0, 4.0), (0.05, 0.05, 0.05))
LIMITS = PlannerLimits(6.0, 40.0, -4.0, 4.0, (3.0, 3.0, 1.5), (-9.0,) * 3, (9.0,) * 3)
PLANNER = Planner(SETTINGS, THRUSTING, Horizon(0.04, 25), LIMITS, 0.0, OsqpSolver)
START = np.arange(15.0).reshape(3, 5) / 10.0
STILL = np.zeros(3)


def look(start, place=STILL, anchor=(0.0, 0.0, 0.0)):
    preview = np.tile(place, (len(PLANNER.preview_times_s()), 1))
    return PLANNER.look(start, THRUSTING, 1.0, STILL, preview, anchor)


@pytest.mark.parametrize("scale", [0.6, 1.0, 1.3, 2.2])
def test_for_a_learnt_lag_the_feedback_is_that_of_the_lagging_vehicle(scale):
    gains = feedback(SETTINGS, THRUSTING.lagging(scale))
    assert PLANNER.rate(START, scale) == pytest.approx(-(gains * START).sum(axis=1))


def test_between_two_lags_it_is_between_theirs():
    middle = 0.5 * (PLANNER.rate(START, 1.1) + PLANNER.rate(START, 1.2))
    assert PLANNER.rate(START, 1.15) == pytest.approx(middle)


@pytest.mark.parametrize(("scale", "last"), [(0.1, 0.6), (5.0, 2.2)])
def test_beyond_the_lags_it_is_that_of_the_last(scale, last):
    assert PLANNER.rate(START, scale) == pytest.approx(PLANNER.rate(START, last))


def test_the_present_is_the_beginning_of_the_preview():
    present, preview = PLANNER.present_times_s(), PLANNER.preview_times_s()
    assert (preview[: len(present)] == present).all()
    assert present[len(present) // 2] == 0.0
    assert preview[-3] == pytest.approx(1.0)


def test_where_no_bound_is_in_sight_the_feedback_decides():
    rates, record = look(0.01 * START)
    assert all(math.isnan(rate) for rate in rates)
    assert record.status == "closed_form"
    assert record.constrained_axes == (False, False, False)


def test_only_the_axis_that_would_leave_a_bound_is_planned():
    start = np.zeros((3, 5))
    start[1, 0] = 3.0
    rates, record = look(start)
    assert [math.isnan(rate) for rate in rates] == [True, False, True]
    assert record.status == "solved"
    assert record.constrained_axes == (False, True, False)
    assert abs(rates[1]) <= LIMITS.horizontal_rate_m_s3 + 0.05


def test_the_fence_lies_about_its_anchor():
    far = np.array([20.0, 0.0, 0.0])
    assert look(np.zeros((3, 5)), far)[1].constrained_axes == (True, False, False)
    assert look(np.zeros((3, 5)), far, (15.0, 0.0, 0.0))[1].status == "closed_form"
