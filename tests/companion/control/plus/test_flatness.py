"""The flat state and input: the nominal plant under them flies the trajectory."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.plus.flatness import AROUND, flat
from companion.control.plus.nominal_plant import discrete
from tests.companion.control.plus.examples import CLIMBING, THRUSTING, plants, vectors

BOTH = pytest.mark.parametrize("plant", [THRUSTING, CLIMBING], ids=["thrust", "climb rate"])
STEP_S = 0.01


def path(amplitude, turn, phase):
    return lambda t: amplitude * np.sin(turn * np.asarray(t)[:, None] + phase)


def along(plant, desired, times, sigma, quadratic=0.0, fine=STEP_S):
    """States and inputs at each of the times."""
    around = fine * np.arange(-AROUND, AROUND + 1)
    found = [flat(plant, desired(t + around), fine, sigma, quadratic) for t in times]
    return np.array([s[0] for s, _ in found]), np.array([u[0] for _, u in found])


@settings(deadline=None, derandomize=True, max_examples=25)
@given(plants, vectors(1.5), st.floats(0.3, 3.0), vectors(3.0), vectors(2.0))
def test_the_nominal_plant_under_the_flat_input_flies_the_trajectory(
    plant, amplitude, turn, phase, sigma
):
    """From the flat state on, over 1.5 s; with drag, and with σ cancelled."""
    desired = path(amplitude, turn, phase)
    starts = STEP_S * np.arange(150)
    states, _ = along(plant, desired, starts, sigma)
    _, inputs = along(plant, desired, starts + 0.5 * STEP_S, sigma)  # held from -½ to +½ step
    a, b = discrete(plant, round(STEP_S * 1e6))
    x = states[0]
    for k, u in enumerate(inputs):
        assert x[:, 0] == pytest.approx(desired([starts[k]])[0], abs=2e-3)
        assert x[:, :2] == pytest.approx(states[k][:, :2], abs=1e-2)
        drive = np.column_stack([u, sigma])
        x = (a @ x[:, :, None])[:, :, 0] + (b @ drive[:, :, None])[:, :, 0]


@BOTH
def test_at_rest_the_input_cancels_the_disturbance_and_nothing_else(plant):
    sigma = np.array([0.5, -0.3, 0.8])
    there = np.tile([3.0, -2.0, 1.0], (5, 1))
    states, inputs = flat(plant, there, STEP_S, sigma, 0.02)
    wanted = -sigma
    if plant.vertical.interface == "climb_rate":
        wanted = wanted * [1.0, 1.0, plant.vertical.lag_s]
    assert inputs[0] == pytest.approx(wanted, abs=1e-9)
    assert states[0, :, :2] == pytest.approx(np.array([[3.0, 0.0], [-2.0, 0.0], [1.0, 0.0]]))
    assert states[0, :, 2] == pytest.approx(-sigma, abs=1e-9)


@BOTH
@settings(deadline=None, derandomize=True, max_examples=20)
@given(vectors(2.0), st.floats(0.0, 0.1))
def test_at_a_steady_speed_all_drag_is_made_up_for(plant, velocity, quadratic):
    times = STEP_S * np.arange(-AROUND, AROUND + 1)
    _, inputs = flat(plant, times[:, None] * velocity, STEP_S, np.zeros(3), quadratic)
    speed = float(np.linalg.norm(velocity))
    wanted = (plant.linear_drag_1_s + quadratic * speed) * velocity
    if plant.vertical.interface == "climb_rate":
        wanted[2] = velocity[2]
    assert inputs[0] == pytest.approx(wanted, abs=1e-6)


@settings(deadline=None, derandomize=True, max_examples=20)
@given(plants, vectors(1.5), st.floats(0.3, 2.0), vectors(3.0), vectors(8.0))
def test_where_the_trajectory_lies_makes_no_difference(plant, amplitude, turn, phase, shift):
    desired = path(amplitude, turn, phase)
    _, here = along(plant, desired, [0.4], np.zeros(3), 0.02)
    _, there = along(plant, lambda t: desired(t) + shift, [0.4], np.zeros(3), 0.02)
    assert there == pytest.approx(here, abs=1e-4)


@BOTH
def test_many_samples_at_once_are_each_one_by_itself(plant):
    desired = path(np.ones(3), 2.0, np.array([0.0, 1.0, 2.0]))
    sigma = np.array([0.1, 0.2, 0.3])
    times = STEP_S * np.arange(-AROUND, 20 + AROUND)
    states, inputs = flat(plant, desired(times), STEP_S, sigma, 0.02)
    each_states, each_inputs = along(plant, desired, times[AROUND:-AROUND], sigma, 0.02)
    assert states == pytest.approx(each_states, abs=1e-9)
    assert inputs == pytest.approx(each_inputs, abs=1e-5)
