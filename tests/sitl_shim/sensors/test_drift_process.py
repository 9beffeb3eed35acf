import numpy as np
import pytest

from sitl_shim.sensors.drift import drift_step

CASES = [
    pytest.param(0.18, 0.18, 0.7, id="underdamped"),
    pytest.param(0.20, 0.27, 1.0, id="critical"),
    pytest.param(0.50, 0.10, 2.5, id="overdamped"),
]


def matrices(step):
    transition = np.array([[step.ee, step.ef], [step.fe, step.ff]])
    factor = np.array([[step.k11, 0.0], [step.k21, step.k22]])
    return transition, factor @ factor.T


@pytest.mark.parametrize(("position", "velocity", "damping"), CASES)
def test_a_step_keeps_the_stationary_covariance(position, velocity, damping):
    transition, noise = matrices(drift_step(position, velocity, damping, 0.004))
    stationary = np.diag([position**2, velocity**2])
    assert transition @ stationary @ transition.T + noise == pytest.approx(stationary, abs=1e-12)


@pytest.mark.parametrize(("position", "velocity", "damping"), CASES)
def test_two_steps_are_one_step_of_twice_the_length(position, velocity, damping):
    once, once_noise = matrices(drift_step(position, velocity, damping, 0.05))
    twice, twice_noise = matrices(drift_step(position, velocity, damping, 0.10))
    assert once @ once == pytest.approx(twice)
    assert once @ once_noise @ once.T + once_noise == pytest.approx(twice_noise)


@pytest.mark.parametrize(("position", "velocity", "damping"), CASES)
def test_the_transition_solves_the_oscillators_equation(position, velocity, damping):
    omega = velocity / position
    step_s = 1e-5
    transition, _ = matrices(drift_step(position, velocity, damping, step_s))
    slope = (transition - np.eye(2)) / step_s
    assert slope == pytest.approx(
        np.array([[0.0, 1.0], [-(omega**2), -2 * damping * omega]]), abs=1e-3
    )


def test_a_step_of_no_length_changes_nothing():
    transition, noise = matrices(drift_step(0.18, 0.18, 0.7, 0.0))
    assert transition == pytest.approx(np.eye(2))
    assert noise == pytest.approx(np.zeros((2, 2)))
