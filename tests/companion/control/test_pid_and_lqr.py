"""The feedback laws: what the baselines see, how they start and saturate, and the LQR's optimum."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control import pid
from companion.control.feedback import FeedbackController, direct
from companion.control.inner import PidController
from companion.control.lqr import LqrWeights, lqr_gains
from companion.control.pid import PidGains
from companion.control.reference_model import PositionModel, discretise_position_model

MODEL = PositionModel((0.5, 0.5, 3.75), (0.75, 0.75, 0.55))
WEIGHTS = LqrWeights((4.0,) * 3, (0.5,) * 3, (0.3,) * 3, (1.0,) * 3)
numbers = st.floats(-5, 5, allow_nan=False)
vectors = st.lists(numbers, min_size=3, max_size=3).map(np.array)


def gains(kp=1.0, ki=0.5, kd=0.2, limit=1.0):
    return PidGains((kp,) * 3, (ki,) * 3, (kd,) * 3, (limit,) * 3)


@settings(deadline=None, derandomize=True)
@given(desired=vectors, position=vectors, velocity=vectors)
def test_with_zero_gains_r2_is_the_desired_position(desired, position, velocity):
    controller = FeedbackController(gains(0.0, 0.0, 0.0))
    for outer in (controller, direct(3)):
        _, r2, _ = outer.step(outer.start(position), position, velocity, desired[None], 0.01)
        np.testing.assert_array_equal(r2, desired)


def test_the_feedback_controllers_see_no_future_and_no_model():
    assert FeedbackController(gains()).preview_times_s.tolist() == [0.0]
    assert FeedbackController(gains()).model is None


def test_the_reference_itself_is_never_differentiated():
    """A jump of y2* moves r2 by (1 + kp) times itself and its integral, and by nothing else."""
    controller = FeedbackController(gains(kp=2.0, ki=0.0, kd=5.0))
    memory = controller.start(np.zeros(3))
    memory, before, _ = controller.step(memory, np.zeros(3), np.zeros(3), np.zeros((1, 3)), 0.01)
    _, after, _ = controller.step(memory, np.zeros(3), np.zeros(3), np.ones((1, 3)), 0.01)
    np.testing.assert_allclose(after - before, 3.0)


def test_the_derivative_of_the_error_can_be_chosen_and_leads_a_moving_reference():
    """On a reference that moves at 1 m/s with the vehicle there, D gives kd of lead."""
    controller = FeedbackController(gains(kp=0.0, ki=0.0, kd=0.4), derivative="error")
    memory = controller.start(np.zeros(3))
    for k in range(3):
        desired = np.full((1, 3), 0.01 * k)
        memory, r2, _ = controller.step(memory, desired[0], np.zeros(3), desired, 0.01)
    np.testing.assert_allclose(r2 - desired[0], 0.4)


@settings(deadline=None, derandomize=True)
@given(errors=st.lists(vectors, min_size=1, max_size=50))
def test_the_integrals_part_stays_within_its_limit(errors):
    law, memory = gains(limit=0.7), pid.start(np.zeros(3))
    for error in errors:
        memory, _, terms = pid.step(law, memory, error, np.zeros(3), 0.5)
        assert (np.abs(terms.integral) <= 0.7).all()


def test_an_integral_does_not_wind_up_behind_a_limit_and_may_unwind():
    law = gains(kp=0.0, ki=1.0, kd=0.0, limit=100.0)
    memory = pid.start(np.full(3, 0.5))
    for _ in range(200):
        memory, output, _ = pid.step(law, memory, np.ones(3), np.zeros(3), 0.1)
        memory = pid.with_applied(memory, np.minimum(output, 0.5))
    np.testing.assert_allclose(memory.integral, 0.5)
    memory, output, _ = pid.step(law, memory, -np.ones(3), np.zeros(3), 0.1)
    memory = pid.with_applied(memory, np.minimum(output, 0.3))
    np.testing.assert_allclose(memory.integral, 0.4)


def test_the_inner_pid_starts_without_a_bump():
    controller = PidController(gains(limit=0.1))
    position, velocity, u = np.array([1.0, 2.0, 3.0]), np.array([2.0, -0.2, 0.1]), np.full(3, 0.05)
    memory, r2 = controller.start(position, velocity, u)
    _, record = controller.step(memory, r2, position, velocity, 0.01)
    np.testing.assert_allclose(record.u, u, atol=1e-12)
    assert np.isnan(record.sigma_hat).all()


def quadratic_cost(law, error, velocity, seconds=60.0, period=0.01):
    """The LQR's cost on D(s) from a state, by simulation of the axis x."""
    a, b = discretise_position_model(np.array(MODEL.m[:1]), np.array(MODEL.gain_k[:1]), period)
    state, integral, total = np.array([error, velocity]), 0.0, 0.0
    for _ in range(round(seconds / period)):
        r = -law[0] * state[0] - law[1] * state[1] + law[2] * integral
        total += 4.0 * state[0] ** 2 + 0.5 * state[1] ** 2 + 0.3 * integral**2 + r**2
        integral -= period * state[0]
        state = a[0] @ state + b[0] * r
    return total


def test_the_lqrs_gains_minimise_its_cost():
    law = lqr_gains(MODEL, WEIGHTS, 0.01, (9.0,) * 3)
    best = (law.kp[0], law.kd[0], law.ki[0])
    least = quadratic_cost(best, 1.0, -0.5)
    for k in range(3):
        for factor in (0.9, 1.1):
            other = list(best)
            other[k] *= factor
            assert quadratic_cost(other, 1.0, -0.5) > least


def test_an_lqr_without_a_solution_is_refused():
    with pytest.raises(ValueError, match="axis 0"):
        lqr_gains(
            MODEL, LqrWeights((0.0,) * 3, (0.0,) * 3, (0.0,) * 3, (1.0,) * 3), 0.01, (1.0,) * 3
        )
