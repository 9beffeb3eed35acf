"""The companion's attitude loop: it goes the short way, tilt first, within its limits."""

import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from companion.control.attitude import AttitudeGains, body_rates, carried
from companion.frames import (
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_multiply,
    quaternion_normalise,
    rotate,
    tilt_cosine,
    wrap_angle_rad,
    yaw_of,
)

GAINS = AttitudeGains(6.0, 2.0, 3.0, 1.5)
LEVEL = (1.0, 0.0, 0.0, 0.0)

component = st.floats(-1.0, 1.0)
quaternions = (
    st.tuples(component, component, component, component)
    .filter(lambda q: math.hypot(*q) > 0.1)
    .map(quaternion_normalise)
)
angles = st.floats(-math.pi, math.pi)
leans = st.floats(-0.9, 0.9)
rates = st.tuples(*[st.floats(-6.0, 6.0)] * 3)


def angle_between(a, b):
    w = quaternion_multiply(quaternion_conjugate(a), b)[0]
    return 2.0 * math.acos(min(1.0, abs(w)))


def tilt_between(a, b):
    first, second = rotate(a, (0.0, 0.0, 1.0)), rotate(b, (0.0, 0.0, 1.0))
    return math.acos(max(-1.0, min(1.0, sum(x * y for x, y in zip(first, second, strict=True)))))


@settings(deadline=None, derandomize=True)
@given(quaternions, quaternions)
def test_rates_are_finite_and_within_their_limits(attitude, desired):
    x, y, z = body_rates(GAINS, attitude, desired)
    assert all(math.isfinite(rate) for rate in (x, y, z))
    assert math.hypot(x, y) <= GAINS.tilt_rate_limit_rad_s + 1e-9
    assert abs(z) <= GAINS.yaw_rate_limit_rad_s + 1e-9


@settings(deadline=None, derandomize=True)
@given(quaternions)
def test_where_it_should_be_it_does_not_turn(attitude):
    assert body_rates(GAINS, attitude, attitude) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


@settings(deadline=None, derandomize=True)
@given(quaternions, quaternions)
def test_both_signs_of_a_quaternion_are_one_attitude(attitude, desired):
    assume(tilt_between(attitude, desired) < 3.1)
    assume(abs(abs(wrap_angle_rad(_turn_left(attitude, desired))) - math.pi) > 1e-3)
    other = tuple(-c for c in desired)
    usual = body_rates(GAINS, attitude, desired)
    assert body_rates(GAINS, attitude, other) == pytest.approx(usual, abs=1e-6)


def _turn_left(attitude, desired):
    """The turn about the body's vertical axis when the tilt is as desired."""
    error = quaternion_multiply(quaternion_conjugate(attitude), desired)
    return 2.0 * math.atan2(error[3], error[0])


@settings(deadline=None, derandomize=True)
@given(quaternions, quaternions, quaternions)
def test_the_law_does_not_know_the_worlds_axes(world, attitude, desired):
    assume(tilt_between(attitude, desired) < 3.1)
    assume(abs(abs(wrap_angle_rad(_turn_left(attitude, desired))) - math.pi) > 1e-3)
    turned = body_rates(
        GAINS, quaternion_multiply(world, attitude), quaternion_multiply(world, desired)
    )
    assert turned == pytest.approx(body_rates(GAINS, attitude, desired), abs=1e-5)


@settings(deadline=None, derandomize=True)
@given(leans, leans, angles, leans, leans, angles)
def test_the_tilt_goes_its_shortest_way_whatever_the_heading_does(r1, p1, y1, r2, p2, y2):
    attitude, desired = quaternion_from_euler(r1, p1, y1), quaternion_from_euler(r2, p2, y2)
    before = tilt_between(attitude, desired)
    assume(before > 0.02)
    x, y, _ = body_rates(GAINS, attitude, desired)
    step = 1e-3
    after = tilt_between(carried(attitude, (x, y, 0.0), step), desired)
    # All of the rate goes into closing the angle: none of it is spent sideways.
    assert (before - after) / step == pytest.approx(math.hypot(x, y), rel=0.02)


@settings(deadline=None, derandomize=True)
@given(leans, leans, angles, leans, leans, angles)
def test_it_converges_tilt_before_heading(r1, p1, y1, r2, p2, y2):
    attitude, desired = quaternion_from_euler(r1, p1, y1), quaternion_from_euler(r2, p2, y2)
    for k in range(600):
        attitude = carried(attitude, body_rates(GAINS, attitude, desired), 0.01)
        if k == 200:
            assert tilt_between(attitude, desired) < 0.02
    assert angle_between(attitude, desired) < 0.02


def test_signs():
    x, y, z = body_rates(GAINS, LEVEL, quaternion_from_euler(0.1, 0.0, 0.0))
    assert (x, y, z) == pytest.approx((0.6, 0.0, 0.0), abs=1e-6)
    x, y, z = body_rates(GAINS, LEVEL, quaternion_from_euler(0.0, 0.1, 0.0))
    assert (x, y, z) == pytest.approx((0.0, 0.6, 0.0), abs=1e-6)
    x, y, z = body_rates(GAINS, LEVEL, quaternion_from_euler(0.0, 0.0, 0.1))
    assert (x, y, z) == pytest.approx((0.0, 0.0, 0.2), abs=1e-6)


def test_upside_down_it_turns_over_at_its_limit():
    x, y, _ = body_rates(GAINS, (0.0, 1.0, 0.0, 0.0), LEVEL)
    assert math.hypot(x, y) == pytest.approx(GAINS.tilt_rate_limit_rad_s)


@settings(deadline=None, derandomize=True)
@given(quaternions, rates, st.floats(0.0, 0.2))
def test_carrying_there_and_back_is_nothing(attitude, rate, seconds):
    there = carried(attitude, rate, seconds)
    assert math.hypot(*there) == pytest.approx(1.0, abs=1e-9)
    assert angle_between(carried(there, rate, -seconds), attitude) < 1e-6


@settings(deadline=None, derandomize=True)
@given(quaternions, rates, st.floats(0.0, 0.1), st.floats(0.0, 0.1))
def test_carrying_twice_is_carrying_for_longer(attitude, rate, first, second):
    twice = carried(carried(attitude, rate, first), rate, second)
    assert angle_between(twice, carried(attitude, rate, first + second)) < 1e-6


def test_a_yaw_rate_turns_the_heading_counter_clockwise():
    assert yaw_of(carried(LEVEL, (0.0, 0.0, 2.0), 0.1)) == pytest.approx(0.2)
    assert tilt_cosine(carried(LEVEL, (1.0, 0.0, 0.0), 0.2)) == pytest.approx(math.cos(0.2))


def delayed_tilt(delay_s, compensated_s, gain=10.0):
    """Largest tilt after a step of 0.2 rad through a rate loop of 50 ms behind a delay."""
    gains = AttitudeGains(gain, 2.0, 8.0, 2.0)
    goal = quaternion_from_euler(0.2, 0.0, 0.0)
    attitude, rate, waiting, largest = LEVEL, 0.0, [0.0] * round(delay_s / 0.005), 0.0
    for _ in range(400):
        seen = carried(attitude, (rate, 0.0, 0.0), compensated_s)
        waiting.append(body_rates(gains, seen, goal)[0])
        rate += 0.005 * (waiting.pop(0) - rate) / 0.05
        attitude = carried(attitude, (rate, 0.0, 0.0), 0.005)
        largest = max(largest, 2.0 * math.atan2(attitude[1], attitude[0]))
    return largest


def test_carrying_over_the_delay_takes_the_overshoot_of_the_delay_away():
    without = delayed_tilt(0.0, 0.0)
    assert delayed_tilt(0.06, 0.0) > without + 0.03
    assert delayed_tilt(0.06, 0.06) < without + 0.02
