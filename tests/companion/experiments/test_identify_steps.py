import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.config.yaml_source import ConfigError
from companion.experiments.flight_task import FlightTask
from companion.experiments.identify_steps import (
    StepTask,
    StepTrajectory,
    UnidentifiedError,
    fit_second_order,
    identify,
    step_response,
)

TIMES = np.arange(0.0, 8.0, 0.01)


@given(omega=st.floats(0.8, 8.0), zeta=st.floats(0.1, 3.0))
@settings(deadline=None, derandomize=True, max_examples=30)
def test_the_fit_finds_the_system_that_made_the_response(omega, zeta):
    noise = np.random.default_rng(1).normal(0.0, 0.002, len(TIMES))

    model = fit_second_order(TIMES, step_response(TIMES, omega, zeta) + noise)

    assert model.natural_frequency_rad_s == pytest.approx(omega, rel=0.02)
    assert model.damping == pytest.approx(zeta, rel=0.02)
    assert model.misfit_rms_m == pytest.approx(0.002, rel=0.2)
    assert model.m == pytest.approx(2.0 * zeta * omega, rel=0.02)
    assert model.m * model.k == pytest.approx(omega**2, rel=0.05)


@pytest.mark.parametrize("zeta", [0.2, 0.999999, 1.0, 1.00001, 4.0])
def test_the_step_response_is_that_of_the_differential_equation(zeta):
    omega, dt = 2.0, 1e-4
    y, rate, expected = 0.0, 0.0, []
    for _ in range(30_000):
        expected.append(y)
        rate += dt * (omega**2 * (1.0 - y) - 2.0 * zeta * omega * rate)
        y += dt * rate

    got = step_response(np.arange(30_000) * dt, omega, zeta)

    assert got == pytest.approx(np.array(expected), abs=2e-3)


@pytest.mark.parametrize(
    "response", [np.full(800, -3.0), np.array([0.0, 1.0]), np.full(800, np.nan)]
)
def test_what_is_no_step_response_is_refused(response):
    with pytest.raises(UnidentifiedError):
        fit_second_order(TIMES[: len(response)], response)


def test_a_step_is_of_one_axis_and_rests_before_and_after():
    step = StepTrajectory(1, 0.5)
    position = step.position(np.array([-1.0, 0.0, 0.99, 1.0, 5.0, 100.0]))

    assert position[:, 1].tolist() == [0.0, 0.0, 0.0, 0.5, 0.5, 0.5]
    assert np.ptp(position[:, [0, 2]], axis=0).tolist() == [0.0, 0.0]


def test_a_vehicle_under_a_pid_is_identified_alike_in_x_and_y():
    gains = (
        ("controller.inner_pid.kp", "[0.35, 0.35, 1.2]"),
        ("controller.inner_pid.ki", "[0.01, 0.01, 0.0]"),
        ("controller.inner_pid.kd", "[0.3, 0.3, 0.0]"),
    )
    task = FlightTask("pid", 4, settings=gains)

    x, y, z = (identify(StepTask(task, axis)) for axis in range(3))

    # Without lag and drag it would be √(g kp) = 1.85 rad/s and g kd / 2ω = 0.79.
    assert x.natural_frequency_rad_s == pytest.approx(1.85, rel=0.2)
    assert 0.4 < x.damping < 1.0
    assert y.natural_frequency_rad_s == pytest.approx(x.natural_frequency_rad_s, rel=0.05)
    assert y.damping == pytest.approx(x.damping, rel=0.1)
    assert z.misfit_rms_m < 0.05
    assert z.k == pytest.approx(1.2, rel=0.3)


def test_steps_need_a_framework_in_which_r2_is_the_desired_position():
    with pytest.raises(ConfigError, match="r2 = y2"):
        identify(StepTask(FlightTask("mpc-l1", 4), 0))
