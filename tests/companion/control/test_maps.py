"""Tilt, yaw and thrust: signs, limits, inverses, and the estimate of the hover thrust."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control import thrust, tilt, yaw
from companion.frames import quaternion_from_euler, rotate, wrap_angle_rad

angles = st.floats(-math.pi, math.pi, allow_nan=False)
GAINS = thrust.ThrustGains(4.0, 1.0, 0.5, 0.0, 0.1, 0.9, 4.0, 0.01, 0.2)


@settings(deadline=None, derandomize=True)
@given(yaw_rad=angles, direction=angles, size=st.floats(0.01, 0.6))
def test_the_thrust_leans_the_way_that_u_points_whatever_the_heading(yaw_rad, direction, size):
    u_x, u_y = size * math.cos(direction), size * math.sin(direction)
    roll, pitch = tilt.roll_pitch_from_u(u_x, u_y, yaw_rad)
    x, y, _ = rotate(quaternion_from_euler(roll, pitch, yaw_rad), (0.0, 0.0, 1.0))
    assert abs(wrap_angle_rad(math.atan2(y, x) - direction)) < 0.12
    assert math.hypot(x, y) == pytest.approx(size, rel=0.2)


@settings(deadline=None, derandomize=True)
@given(yaw_rad=angles, u_x=st.floats(-0.6, 0.6), u_y=st.floats(-0.6, 0.6))
def test_u_and_attitude_are_inverse_maps(yaw_rad, u_x, u_y):
    back = tilt.u_from_roll_pitch(*tilt.roll_pitch_from_u(u_x, u_y, yaw_rad), yaw_rad)
    assert back == pytest.approx((u_x, u_y), abs=1e-12)


def test_signs_of_the_papers_map():
    roll, pitch = tilt.roll_pitch_from_u(0.2, 0.0, 0.0)
    assert (roll, pitch) == pytest.approx((0.0, math.asin(0.2)))
    roll, pitch = tilt.roll_pitch_from_u(0.0, 0.2, 0.0)
    assert (roll, pitch) == pytest.approx((-math.asin(0.2), 0.0))


@settings(deadline=None, derandomize=True)
@given(u_x=st.floats(-1e3, 1e3), u_y=st.floats(-1e3, 1e3), limit=st.floats(0.05, 1.0))
def test_the_tilt_limit_is_one_of_the_vector_and_keeps_its_direction(u_x, u_y, limit):
    x, y = tilt.limit_tilt(u_x, u_y, limit)
    assert math.hypot(x, y) <= math.sin(limit) * (1 + 1e-9)
    assert x * u_y == pytest.approx(y * u_x, abs=1e-6 * (1 + abs(u_x) * abs(u_y)))


def test_u_longer_than_one_is_refused():
    with pytest.raises(ValueError, match="limit the tilt"):
        tilt.roll_pitch_from_u(0.9, 0.9, 0.0)


def test_yaw_goes_the_short_way_at_its_rate():
    gains = yaw.YawGains(gain=2.0, rate_limit_rad_s=0.5)
    command, measured = math.radians(170.0), math.radians(170.0)
    for _ in range(100):
        command = yaw.step(gains, command, math.radians(-170.0), measured, 0.01)
        step = wrap_angle_rad(command - measured)
        assert 0.0 <= step <= 0.005 + 1e-9
        measured = command
    assert abs(wrap_angle_rad(command - math.radians(-170.0))) < math.radians(4.0)


def test_the_yaw_command_never_runs_far_ahead_of_a_vehicle_that_does_not_turn():
    gains = yaw.YawGains(gain=2.0, rate_limit_rad_s=2.0, lead_limit_rad=0.3)
    command = 0.0
    for _ in range(1000):
        command = yaw.step(gains, command, 3.0, 0.0, 0.01)
    assert command == pytest.approx(0.3)


@pytest.mark.parametrize("curve", [0.0, 0.3, 1.0])
def test_the_thrust_curve_has_its_inverse(curve):
    for field in np.linspace(0.0, 1.0, 11):
        force = thrust.force_from_thrust(float(field), curve)
        assert thrust.thrust_from_force(force, curve) == pytest.approx(field, abs=1e-12)


def climb(gains, seconds, command, *, true_hover, tilt_cosine=1.0, noise=0.0, seed=0):
    """A vertical body under the loop: thrust with a 40 ms lag, noisy climb rate."""
    rng = np.random.default_rng(seed)
    memory = thrust.start(gains, 0.0)
    v, force, rates, fields = 0.0, gains.hover_thrust, [], []
    for k in range(round(seconds / 0.01)):
        measured = v + noise * rng.standard_normal()
        memory, field = thrust.step(gains, memory, command(k * 0.01), measured, tilt_cosine, 0.01)
        for _ in range(10):
            force += 0.001 * (field - force) / 0.04
            v += 0.001 * 9.80665 * (force * tilt_cosine / true_hover - 1.0)
        rates.append(v)
        fields.append(field)
    return memory, np.array(rates), np.array(fields)


def test_a_climb_rate_is_reached_with_a_wrong_guess_of_the_hover_thrust():
    _, rates, _ = climb(GAINS, 8.0, lambda t: 0.5, true_hover=0.58)
    assert rates[-100:] == pytest.approx(0.5, abs=0.02)


def test_the_hover_thrust_is_found_from_noisy_climb_rates():
    memory, _, _ = climb(GAINS, 40.0, lambda t: 0.0, true_hover=0.57, noise=0.015)
    assert memory.hover_force == pytest.approx(0.57, rel=0.02)


def test_tilt_is_compensated_once():
    cosine = math.cos(math.radians(30.0))
    level, _, fields = climb(GAINS, 30.0, lambda t: 0.0, true_hover=0.5)
    tilted, rates, fields_tilted = climb(
        GAINS, 30.0, lambda t: 0.0, true_hover=0.5, tilt_cosine=cosine
    )
    assert fields_tilted[-1] * cosine == pytest.approx(fields[-1], rel=0.01)
    assert tilted.hover_force == pytest.approx(level.hover_force, rel=0.01)
    assert abs(rates[-1]) < 0.01


def test_thrust_stays_within_its_limits_and_the_integral_does_not_wind_up():
    memory, _, fields = climb(GAINS, 10.0, lambda t: 50.0, true_hover=0.5)
    assert fields.max() <= 0.9
    assert fields.min() >= 0.1
    assert abs(memory.integral_m_s2) < 5.0
