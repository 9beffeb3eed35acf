"""A tilt and the horizontal acceleration that it makes: there and back."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.plus import measured
from companion.control.thrust import GRAVITY_M_S2
from companion.frames import quaternion_from_euler, quaternion_multiply, rotate
from companion.vehicle_state import VehicleState
from tests.companion.control.plus.examples import vectors

yaws = st.floats(-math.pi, math.pi)
forces = st.floats(3.0, 15.0)
angles = st.floats(-0.9, 0.9)


def state(attitude, rate=(0.0, 0.0, 0.0)):
    return VehicleState(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), attitude, rate)


@settings(deadline=None, derandomize=True)
@given(vectors(10.0, 2), forces, yaws)
def test_what_is_asked_for_is_what_the_tilt_makes(asked, force, yaw):
    direction = measured.thrust_direction(asked, force)
    roll, pitch = measured.roll_pitch(direction, yaw)
    attitude = quaternion_from_euler(roll, pitch, yaw)
    assert rotate(attitude, (0.0, 0.0, 1.0)) == pytest.approx(direction, abs=1e-12)
    got = measured.tilt_acceleration(state(attitude), force)
    assert got[:, 0] == pytest.approx(asked, abs=1e-9)
    assert got[:, 1] == pytest.approx([0.0, 0.0], abs=1e-12)


@settings(deadline=None, derandomize=True)
@given(angles, angles, yaws, vectors(3.0), forces)
def test_its_rate_is_what_the_body_rates_make_of_it(roll, pitch, yaw, rate, force):
    attitude = quaternion_from_euler(roll, pitch, yaw)
    h = 1e-5

    def after(time_s):
        turn = (1.0, *(0.5 * time_s * rate))
        norm = math.sqrt(sum(c * c for c in turn))
        later = quaternion_multiply(attitude, tuple(c / norm for c in turn))
        return measured.tilt_acceleration(state(later), force)[:, 0]

    wanted = (after(h) - after(-h)) / (2.0 * h)
    got = measured.tilt_acceleration(state(attitude, tuple(rate)), force)[:, 1]
    assert got == pytest.approx(wanted, rel=1e-4, abs=1e-4)


@settings(deadline=None, derandomize=True)
@given(yaws, st.floats(-5.0, 5.0))
def test_level_flight_pushes_nowhere_however_it_turns(yaw, turn):
    level = quaternion_from_euler(0.0, 0.0, yaw)
    got = measured.tilt_acceleration(state(level, (0.0, 0.0, turn)), GRAVITY_M_S2)
    assert got == pytest.approx(np.zeros((2, 2)), abs=1e-12)


def test_a_vehicle_on_its_side_pushes_no_more_than_can_be_reckoned_with():
    side = quaternion_from_euler(0.0, math.radians(90.0), 0.0)
    got = measured.tilt_acceleration(state(side), GRAVITY_M_S2)
    assert np.isfinite(got).all()
    assert np.abs(got[:, 0]).max() <= 5.0 * GRAVITY_M_S2
