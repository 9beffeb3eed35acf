"""Which flights a soak flies, and the figure-eight that takes as long as one likes."""

import math
from itertools import islice, pairwise

import numpy as np
import pytest

from companion.config.resolve import load_flight
from companion.flight.assemble import infeasibilities, make_trajectory
from companion.flight.beginning import shim_options
from tools.soak.figure_eight import LONGEST_S, figure_eight, write_figure_eight
from tools.soak.plans import ROUND, rounds


def test_a_round_has_each_trajectory_on_each_flavour_and_one_flight_with_faults():
    plans = list(islice(rounds(None, None), ROUND))
    assert {(p.autopilot, p.trajectory) for p in plans} == {
        (flavour, number) for flavour in ("px4", "ardupilot") for number in range(1, 6)
    }
    assert [p.faults for p in plans].count("bad-link") == 1


def test_no_two_of_many_flights_are_the_same():
    plans = list(islice(rounds(None, None), 100))
    assert len({p.seed for p in plans}) == 100
    assert {p.wind for p in plans} == {"calm", "fan", "gusts", "wind3"}


def test_one_flavour_and_one_controller_may_be_asked_for():
    plans = list(islice(rounds("ardupilot", "pid-l1"), ROUND))
    assert {(p.autopilot, p.controller) for p in plans} == {("ardupilot", "pid-l1")}


def test_every_flight_of_a_round_can_be_begun():
    for plan in islice(rounds(None, None), ROUND):
        config = load_flight(None, plan.options, {})
        assert shim_options(config, lockstep=True).autopilot == plan.autopilot


@pytest.mark.parametrize("duration_s", [10.0, 61.3, 600.0])
def test_a_figure_eight_takes_its_time_and_begins_and_ends_at_rest(duration_s):
    points = figure_eight(duration_s)
    assert (points[0][0], points[-1][0]) == (0.0, duration_s)
    speeds = [math.dist(a[1:], b[1:]) / (b[0] - a[0]) for a, b in pairwise(points)]
    assert max(speeds) < 1.0
    assert (speeds[0], speeds[-1]) == pytest.approx((0.0, 0.0), abs=0.02)


@pytest.mark.parametrize("duration_s", [9.9, LONGEST_S + 1.0])
def test_a_figure_eight_too_short_or_too_long_is_refused(duration_s):
    with pytest.raises(ValueError, match="give 10 to 3600 s"):
        figure_eight(duration_s)


@pytest.mark.parametrize("vehicle", ["bebop2", "arducopter"])
def test_the_longest_figure_eight_can_be_flown_by_those_that_fly_it(tmp_path, vehicle):
    file = tmp_path / "eight.csv"
    write_figure_eight(file, LONGEST_S)
    config = load_flight(None, {"trajectory": str(file), "vehicle": vehicle}, {})
    trajectory = make_trajectory(config.mission)
    assert trajectory.end_s == LONGEST_S
    assert infeasibilities(trajectory, config.mission, config.vehicle) == []
    middle = trajectory.motion(np.linspace(10.0, 3590.0, 5000))
    assert np.linalg.norm(middle.acceleration_m_s2, axis=1).max() < 0.7
