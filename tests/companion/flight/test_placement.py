"""Where a mission lies: about the place of take-off, moved, turned; the fence about the same."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.config.models import GeofenceConfig, MissionConfig, OriginConfig
from companion.config.resolve import load_flight
from companion.flight.assemble import fence_infeasibilities, infeasibilities, make_stack
from companion.flight.setpoints.placement import PlacedTrajectory, Placement, about_anchor, place
from companion.trajectories.from_file import SplineTrajectory
from companion.trajectories.harmonic import TEST_TRAJECTORIES

TAKEOFF = (4.0, -7.0, 0.5)
LINE = SplineTrajectory("line", (0.0, 2.0, 4.0), ((0, 0, 1), (1, 0, 1), (2, 0, 1)))
"""Two metres along x."""
metres = st.floats(-50.0, 50.0)
points = st.tuples(metres, metres, metres)


def end_of(placement):
    return PlacedTrajectory(LINE, placement).position(np.array([4.0]))[0].tolist()


def test_by_default_it_lies_about_the_take_off_with_x_east():
    placement = place(OriginConfig(), TAKEOFF, yaw_rad=1.0)
    assert placement == Placement(TAKEOFF, TAKEOFF, 0.0)
    assert end_of(placement) == pytest.approx([6.0, -7.0, 1.5])


def test_the_offset_moves_it_and_the_heading_turns_it_counter_clockwise():
    origin = OriginConfig(offset_enu_m=(1.0, 2.0, 3.0), heading_deg=90.0)
    assert end_of(place(origin, TAKEOFF, 1.0)) == pytest.approx([5.0, -3.0, 4.5])


def test_the_vehicles_heading():
    origin = OriginConfig(heading_deg="vehicle")
    assert end_of(place(origin, TAKEOFF, math.pi)) == pytest.approx([2.0, -7.0, 1.5])


@pytest.mark.parametrize("takeoff", [TAKEOFF, None])
def test_local_is_the_autopilots_own_origin(takeoff):
    origin = OriginConfig(at="local", offset_enu_m=(0.5, 0.0, 0.0))
    assert place(origin, takeoff, 0.3).origin_enu_m == (0.5, 0.0, 0.0)


def test_without_a_take_off_it_lies_in_the_local_frame():
    assert place(OriginConfig(), None, 0.3) == Placement((0.0,) * 3, (0.0,) * 3, 0.0)


@settings(deadline=None, derandomize=True, max_examples=30)
@given(points, points, st.floats(-400.0, 400.0), st.sampled_from([1, 3, 5]))
def test_placing_is_a_rigid_motion_that_keeps_heights_and_derivatives(at, offset, heading, number):
    origin = OriginConfig(offset_enu_m=offset, heading_deg=heading)
    plain = TEST_TRAJECTORIES[number]
    placed = PlacedTrajectory(plain, place(origin, at, 0.0))
    times = np.linspace(0.0, plain.end_s, 40)
    before, after = plain.motion(times), placed.motion(times)
    assert np.allclose(placed.position(times), after.position_m)
    for name in ("position_m", "velocity_m_s", "acceleration_m_s2"):
        was, now = getattr(before, name), getattr(after, name)
        lengths = [np.linalg.norm(np.diff(v, axis=0), axis=1) for v in (was, now)]
        assert np.allclose(*lengths, atol=1e-9)
    assert np.allclose(after.position_m[:, 2] - before.position_m[:, 2], at[2] + offset[2])
    step = 1e-4
    moved = (placed.position(times + step) - placed.position(times - step)) / (2.0 * step)
    assert np.allclose(moved, after.velocity_m_s, atol=1e-3)
    assert (placed.name, placed.end_s, placed.scored_s) == (plain.name, plain.end_s, plain.scored_s)


def test_a_heading_of_zero_changes_no_bit():
    times = np.linspace(0.0, 20.0, 50)
    plain = TEST_TRAJECTORIES[4]
    placed = PlacedTrajectory(plain, place(OriginConfig(), None, 0.0))
    assert np.array_equal(placed.position(times), plain.position(times))


def mission(heading, **changes):
    fence = GeofenceConfig(low_m=(-0.5, -0.5, 0.0), high_m=(2.5, 0.5, 2.0))
    return MissionConfig(origin=OriginConfig(heading_deg=heading, **changes), geofence=fence)


def test_the_fence_is_checked_against_the_turned_trajectory():
    vehicle = load_flight(None, {}, {}).vehicle
    assert infeasibilities(LINE, mission(0.0), vehicle) == []
    (text,) = infeasibilities(LINE, mission(90.0), vehicle)
    assert "(0.00, 2.00, 1.00) m is 1.50 m outside on y" in text
    (text,) = infeasibilities(LINE, mission(0.0, offset_enu_m=(0.0, 0.0, 9.0)), vehicle)
    assert "8.00 m outside on z" in text


def test_with_the_vehicles_heading_it_is_checked_once_that_is_known():
    vehicle = load_flight(None, {}, {}).vehicle
    asked = mission("vehicle")
    assert infeasibilities(LINE, asked, vehicle) == []
    ahead, aside = (place(asked.origin, TAKEOFF, yaw) for yaw in (0.0, math.pi / 2))
    assert fence_infeasibilities(LINE, asked, ahead) == []
    assert "1.50 m outside on y" in fence_infeasibilities(LINE, asked, aside)[0]


@settings(deadline=None, derandomize=True, max_examples=20)
@given(points, points)
def test_about_its_anchor_a_placement_is_its_offset(at, offset):
    seen = about_anchor(place(OriginConfig(offset_enu_m=offset), at, 0.0))
    assert seen.anchor_enu_m == (0.0, 0.0, 0.0)
    assert seen.origin_enu_m == pytest.approx(offset, abs=1e-9)


def test_the_stacks_fence_moves_with_the_anchor():
    config = load_flight(None, {}, {})
    stack = make_stack(config.controller, config.vehicle, config.mission)
    moved = stack.about(TAKEOFF)
    low, high = config.mission.geofence.low_m, config.mission.geofence.high_m
    assert moved.outer.settings.box_low_m == pytest.approx(np.add(low, TAKEOFF))
    assert moved.outer.settings.box_high_m == pytest.approx(np.add(high, TAKEOFF))
    assert stack.outer.settings.box_low_m == low
