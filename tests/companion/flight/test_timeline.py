"""The reference of a whole flight: continuous in position and velocity, phases in order."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.flight.setpoints.placement import PlacedTrajectory, Placement
from companion.flight.setpoints.timeline import plan_timeline
from companion.trajectories.from_file import SplineTrajectory
from companion.trajectories.harmonic import TEST_TRAJECTORIES
from companion.trajectories.rest import Rest

STEP_S = 1e-3
SPLINE = SplineTrajectory(
    "line", (0.0, 1.0, 2.0, 3.0, 4.0, 5.0),
    ((0, 0, 1), (0.2, 0, 1), (0.5, 0.1, 1), (0.8, 0.1, 1.1), (1, 0, 1.2), (1, 0, 1.2)),
)  # fmt: skip
coordinate = st.floats(-3.0, 3.0)
point = st.tuples(coordinate, coordinate, st.floats(0.3, 4.0))


def make(trajectory=SPLINE, start_s=12.5, from_m=(0.1, -0.2, 2.5), home_m=None, **changes):
    home = from_m if home_m is None else home_m
    usual = {"hover_s": 1.0, "speed_m_s": 0.6}
    return plan_timeline(
        trajectory,
        start_s=start_s,
        from_m=np.array(from_m),
        home_m=np.array(home),
        **(usual | changes),
    )


def samples(timeline):
    times = timeline.start_s + np.arange(-0.5, timeline.end_s + 1.0, STEP_S)
    return times, timeline.position(times)


@pytest.mark.parametrize("number", [1, 2, 3, 4, 5])
def test_position_and_velocity_are_continuous_over_a_whole_flight(number):
    timeline = make(TEST_TRAJECTORIES[number], hover_s=4.0)
    _, position = samples(timeline)
    velocity = np.diff(position, axis=0) / STEP_S
    assert np.linalg.norm(velocity, axis=1).max() < 3.0
    # A jump of velocity of a few cm/s would show as tens of m/s² here.
    acceleration = np.linalg.norm(np.diff(velocity, axis=0), axis=1) / STEP_S
    assert acceleration.max() < 5.0


@settings(deadline=None, derandomize=True, max_examples=30)
@given(point, point, st.floats(0.1, 2.0))
def test_moves_begin_and_end_at_rest_and_keep_their_speed(begin, home, speed):
    timeline = make(from_m=begin, home_m=home, speed_m_s=speed)
    _, position = samples(timeline)
    velocity = np.diff(position, axis=0) / STEP_S
    assert position[0] == pytest.approx(np.array(begin))
    assert position[-1] == pytest.approx(np.array(home), abs=1e-9)
    for joint in timeline.begins_s[:3]:
        near = round((joint + 0.5) / STEP_S)
        assert np.linalg.norm(velocity[near - 1 : near + 1], axis=1).max() < 0.02
    approach = velocity[500 : round((timeline.begins_s[1] + 0.5) / STEP_S)]
    assert np.linalg.norm(approach, axis=1).max() <= speed * 1.001


def test_phases_follow_one_another():
    timeline = make()
    times, _ = samples(timeline)
    names = []
    for time in times:
        name = timeline.phase(float(time))
        if names[-1:] != [name]:
            names.append(name)
    assert names == ["approach", "hover", "track", "settle", "return", "settle"]


def test_the_scored_part_is_the_trajectory():
    timeline = make()
    begin, end = timeline.scored_s
    assert timeline.phase(begin + 1e-6) == "track"
    assert end - begin == SPLINE.scored_s
    assert not timeline.finished(end)
    assert timeline.finished(timeline.start_s + timeline.end_s)


def test_many_times_at_once_are_as_one_by_one():
    timeline = make()
    times = timeline.start_s + np.linspace(-1.0, timeline.end_s + 1.0, 173)
    one_by_one = np.vstack([timeline.position(np.array([t])) for t in times])
    assert np.array_equal(timeline.position(times), one_by_one)


def test_without_a_hover_nothing_breaks():
    timeline = make(hover_s=0.0)
    _, position = samples(timeline)
    assert np.isfinite(position).all()
    assert np.abs(np.diff(position, axis=0)).max() < 0.01


def test_times_may_come_in_any_order_across_every_boundary() -> None:
    """A controller asks for a preview and for the present at once."""
    timeline = plan_timeline(
        TEST_TRAJECTORIES[4],
        start_s=100.0,
        from_m=np.array([1.0, -0.5, 2.0]),
        home_m=np.zeros(3),
        hover_s=1.0,
        speed_m_s=0.6,
    )
    shuffle = np.random.default_rng(0)
    for begin in timeline.begins_s:
        times = timeline.start_s + begin + np.linspace(-0.5, 0.5, 41)
        order = shuffle.permutation(len(times))
        np.testing.assert_array_equal(
            timeline.position(times[order]), timeline.position(times)[order]
        )


@pytest.mark.parametrize(
    "trajectory", [*TEST_TRAJECTORIES.values(), SPLINE, Rest("rest", 1.2, 8.0)]
)
@pytest.mark.parametrize("heading_rad", [0.0, 0.7])
def test_one_time_and_many_give_the_same_positions(trajectory, heading_rad):
    placed = PlacedTrajectory(trajectory, Placement((0.0, 0.0, 0.0), (0.4, -0.3, 0.1), heading_rad))
    timeline = make(placed, home_m=(0.5, 0.5, 2.0))
    times = timeline.start_s + np.linspace(-0.5, timeline.end_s + 1.0, 500)
    one_by_one = [timeline.position_at(t) for t in times.tolist()]
    np.testing.assert_allclose(one_by_one, timeline.position(times), rtol=0.0, atol=1e-12)


def test_times_in_any_order_give_the_positions_of_each():
    timeline = make(TEST_TRAJECTORIES[5])
    times = timeline.start_s + np.linspace(0.0, timeline.end_s, 300)
    shuffled = np.random.default_rng(0).permutation(len(times))
    np.testing.assert_allclose(
        timeline.position(times[shuffled]), timeline.position(times)[shuffled], atol=1e-12
    )
