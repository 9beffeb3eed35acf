"""From synthetic recordings back to the figures that they were made of."""

import dataclasses
import math

import numpy as np
import pytest

from companion.identification.attitude_fit import fit_tilt
from companion.identification.climb_fit import climb_by_lift, fit_climb
from companion.identification.estimates import Estimate, UnidentifiedError
from companion.identification.identify import identify, identify_weighted
from companion.identification.lift_fit import fit_lift, fit_reported_lift
from companion.identification.lift_model import lag_as_second_order
from companion.identification.link_fit import fit_loop_delay
from companion.identification.push_fit import fit_push
from tests.companion.identification.synthetic import (
    CLIMB_RATE,
    GNSS,
    MOCAP,
    Noise,
    Truth,
    record,
    with_columns,
    without,
)

TRUTH = Truth()


@pytest.fixture(scope="module")
def exact():
    return record(TRUTH, Noise(), 1)


@pytest.fixture(scope="module")
def mocap():
    return record(TRUTH, MOCAP, 2)


def near(estimate: Estimate, value: float, tolerance: float) -> bool:
    return abs(estimate.value - value) <= tolerance


def test_attitude_of_a_noiseless_flight_is_found_to_the_last_digits(exact):
    for axis in ("roll", "pitch"):
        found = fit_tilt(exact, axis).response
        assert near(found.natural_frequency_rad_s, TRUTH.omega_rad_s, 0.01)
        assert near(found.damping, TRUTH.zeta, 0.001)
        assert near(found.dead_time_s, TRUTH.dead_time_s, 1e-4)
        assert near(found.gain, TRUTH.gain, 1e-3)


def test_lift_of_a_noiseless_flight_is_found(exact):
    lift = fit_lift(exact)
    omega, zeta = lag_as_second_order(TRUTH.lag_s)
    assert near(lift.response.natural_frequency_rad_s, omega, 0.01 * omega)
    assert near(lift.response.damping, zeta, 0.01 * zeta)
    assert near(lift.response.dead_time_s, TRUTH.lift_dead_time_s, 1e-3)
    assert near(lift.response.gain, 1.0, 0.01)
    assert near(lift.hover_thrust, TRUTH.hover_thrust, 0.002 * TRUTH.hover_thrust)


def test_climb_of_a_noiseless_flight_is_found():
    flown = record(TRUTH, Noise(), 1, CLIMB_RATE)
    climb = fit_climb(flown).response
    assert near(climb.natural_frequency_rad_s, TRUTH.climb_omega_rad_s, 0.01)
    assert near(climb.damping, TRUTH.climb_zeta, 0.005)
    assert near(climb.dead_time_s, TRUTH.climb_dead_time_s, 5e-4)
    assert near(climb.gain, 1.0, 0.005)


def test_a_climb_that_drowns_in_the_wander_is_taken_for_a_usual_one():
    slow = dataclasses.replace(TRUTH, climb_dead_time_s=0.3)
    drowned = dataclasses.replace(GNSS, walk_m_s2_sqrt_hz=0.4)
    seen = fit_climb(record(slow, MOCAP, 1, CLIMB_RATE)).response.dead_time_s
    hidden = fit_climb(record(slow, drowned, 1, CLIMB_RATE)).response.dead_time_s
    assert near(seen, 0.3, 0.02)
    assert near(hidden, 0.08, 0.06)
    assert hidden.half_width_95 > 5.0 * seen.half_width_95


def test_push_drag_and_trim_of_a_noiseless_flight_are_found(exact):
    push = fit_push(exact)
    assert near(push.tilt_gain, TRUTH.tilt_gain, 0.003)
    assert near(push.linear_drag_1_s, TRUTH.linear_drag_1_s, 0.02)
    assert near(push.quadratic_drag_1_m, TRUTH.quadratic_drag_1_m, 0.01)
    assert near(push.trim_roll_rad, TRUTH.trim_roll_rad, 5e-4)
    assert near(push.trim_pitch_rad, TRUTH.trim_pitch_rad, 5e-4)


def test_tilt_gain_does_not_mind_a_heading_that_is_off(exact):
    # Turned by 12° in the report: the push is the same, in another direction.
    turn = math.radians(12.0)
    half = np.array([math.cos(0.5 * turn), 0.0, 0.0, math.sin(0.5 * turn)])
    w, x, y, z = exact.attitude_flu_to_enu.T
    c, s = half[0], half[3]
    turned = np.stack([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], axis=1)
    push = fit_push(with_columns(exact, attitude_flu_to_enu=turned))
    assert near(push.tilt_gain, TRUTH.tilt_gain, 0.005)


def test_noise_is_told_apart_in_its_parts():
    identified = identify(record(TRUTH, GNSS, 5))
    for axis in identified.noise_estimates.velocity_m_s:
        assert near(axis, GNSS.velocity_m_s, 1.5 * axis.half_width_95)
        assert axis.half_width_95 < GNSS.velocity_m_s
    found = identified.noise
    assert found.position_m == pytest.approx((GNSS.position_m,) * 3, rel=0.1)
    assert found.acceleration_m_s2_sqrt_hz == pytest.approx((GNSS.walk_m_s2_sqrt_hz,) * 3, rel=0.2)
    assert found.tilt_rad == pytest.approx(GNSS.tilt_rad, rel=0.1)


def test_delay_and_jitter_are_those_of_the_samples(mocap):
    delay, jitter = fit_loop_delay(mocap)
    assert near(delay, TRUTH.loop_delay_s, 2.0 * delay.half_width_95)
    assert near(jitter, TRUTH.jitter_s, 2.0 * jitter.half_width_95)


def test_climb_over_a_lift_without_lag_is_the_thrust_law_itself(exact):
    lift = fit_lift(exact)
    quick = np.array([0.002, 0.0, TRUTH.hover_thrust, 1.0, 0.0])
    response = climb_by_lift(dataclasses.replace(lift, values=quick, covariance=np.zeros((5, 5))))
    # v' = 4 (1 - v) + integral: 63 % after a quarter of a second, hardly second order.
    assert response.dead_time_s.value < 0.02
    slow = 2.0 * response.damping.value / response.natural_frequency_rad_s.value
    assert slow == pytest.approx(0.25, rel=0.25)
    assert response.gain.half_width_95 == 0.0


def test_where_the_autopilot_climbs_there_is_no_lift_and_no_hover_thrust():
    found = identify(record(TRUTH, MOCAP, 3, CLIMB_RATE))
    assert found.lift is None
    assert found.hover_thrust is None
    assert [curve.name for curve in found.curves] == ["roll", "pitch", "climb", "x", "y"]


def test_the_reported_thrust_tells_the_hover_thrust():
    flown = record(TRUTH, MOCAP, 3)
    reported = with_columns(flown, reported_thrust=flown.thrust)
    found = fit_reported_lift(reported)
    assert found is not None
    assert near(found.hover_thrust, TRUTH.hover_thrust, found.hover_thrust.half_width_95)
    assert found.hover_thrust.half_width_95 < 0.01 * TRUTH.hover_thrust


def test_the_weighting_of_another_recording_is_kept(exact, mocap):
    _, weighting = identify_weighted(mocap)
    found, kept = identify_weighted(exact, weighting=weighting)
    assert kept == weighting
    own, _ = identify_weighted(exact)
    assert found.hover_thrust is not None
    assert own.hover_thrust is not None
    assert found.hover_thrust.half_width_95 > own.hover_thrust.half_width_95


def test_samples_that_were_lost_do_little_harm(mocap):
    draws = np.random.default_rng(4)
    kept = draws.random(len(mocap)) > 0.1
    found = fit_tilt(mocap.rows(kept), "roll").response
    assert near(found.natural_frequency_rad_s, TRUTH.omega_rad_s, 0.02 * TRUTH.omega_rad_s)
    assert near(found.dead_time_s, TRUTH.dead_time_s, 0.006)


@pytest.mark.parametrize("part", ["hover", "roll", "pitch", "thrust", "swing"])
def test_a_part_that_was_not_flown_is_named(exact, part):
    last = part == "swing"
    why = "ended early. Fly it to its end" if last else "though the flight went on. Fly it again"
    with pytest.raises(UnidentifiedError, match=f"'{part}'.*{why}"):
        identify(without(exact, part))


def test_commands_too_small_are_refused(exact):
    with pytest.raises(UnidentifiedError, match=r"roll move by 0.* Fly larger steps"):
        fit_tilt(with_columns(exact, roll_rad=0.01 * exact.roll_rad), "roll")
    with pytest.raises(UnidentifiedError, match=r"thrust moves by 0%.* Fly a larger wave"):
        fit_lift(with_columns(exact, thrust=np.full(len(exact), 0.5)))


def test_a_vehicle_that_does_not_follow_is_refused(exact):
    other = np.roll(exact.attitude_flu_to_enu, 3000, axis=0)
    with pytest.raises(UnidentifiedError, match="no second-order response fits roll"):
        fit_tilt(with_columns(exact, attitude_flu_to_enu=other), "roll")


def test_too_little_motion_for_drag_is_refused(exact):
    with pytest.raises(UnidentifiedError, match="larger box"):
        fit_push(with_columns(exact, velocity_enu_m_s=0.1 * exact.velocity_enu_m_s))


def test_a_delay_that_was_never_measured_is_refused(exact):
    with pytest.raises(UnidentifiedError, match="TIMESYNC"):
        fit_loop_delay(with_columns(exact, loop_delay_s=np.full(len(exact), math.nan)))
