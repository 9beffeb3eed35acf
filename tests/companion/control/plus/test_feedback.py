"""The optimum without constraints: stabilising, and what its weights say that it is."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.plus.feedback import FeedbackSettings, feedback, riccati
from companion.control.plus.nominal_plant import Actuation, NominalPlant, discrete
from tests.companion.control.plus.examples import CLIMBING, THRUSTING, plants

SHIPPED = FeedbackSettings((9.5, 9.5, 8.0), (0.05, 0.05, 0.05))
OVER_A_CLIMB_RATE = FeedbackSettings((9.5, 9.5, 3.0), (0.05, 0.05, 0.1))


def weights(bandwidth, tau, step_s=0.01):
    return FeedbackSettings((bandwidth,) * 3, (tau,) * 3, step_s)


def closed(plant, axis, gain, step_s):
    """One step of the plant and w under w' = -gain (x, w)."""
    a, b = discrete(plant, round(step_s * 1e6))
    open_loop = np.eye(5)
    open_loop[:4, :4], open_loop[:4, 4] = a[axis], b[axis, :, 0]
    push = np.append(b[axis, :, 0], 1.0)
    return open_loop - np.outer(push, step_s * gain)


def poles(plant, axis, gain, step_s=0.01):
    found = np.linalg.eigvals(closed(plant, axis, gain, step_s)).astype(complex)
    return [cmath.log(z) / step_s for z in found if abs(z) > 1e-9]


@settings(deadline=None, derandomize=True, max_examples=25)
@given(plants, st.floats(0.5, 12.0), st.floats(0.01, 0.3), st.sampled_from([0.005, 0.01, 0.04]))
def test_any_vehicle_is_stabilised_by_any_bandwidth(plant, bandwidth, tau, step_s):
    gains = feedback(weights(bandwidth, tau, step_s), plant)
    for axis in range(3):
        assert np.abs(np.linalg.eigvals(closed(plant, axis, gains[axis], step_s))).max() < 1.0


def cost_of(problem, gain, start):
    """Of a feedback from a start, summed up over 30 s."""
    loop, x, total = problem.a - np.outer(problem.b, gain), start, 0.0
    for _ in range(3000):
        both = np.append(x, -float(gain @ x))
        total += float(both @ problem.stage @ both)
        x = loop @ x
    return total


@pytest.mark.parametrize(("plant", "axis"), [(THRUSTING, 0), (THRUSTING, 2), (CLIMBING, 2)])
def test_any_other_feedback_costs_more(plant, axis):
    rng = np.random.default_rng(1)
    best = riccati(SHIPPED, plant, axis)
    start = np.array([0.3, -0.2, 0.0, 0.0, 0.1])
    if plant.axes[axis].interface == "acceleration":
        start[2:4] = 0.2, -0.5
    optimal = cost_of(best, best.gain, start)
    assert optimal == pytest.approx(float(start @ best.cost @ start), rel=1e-6)
    for _ in range(5):
        other = cost_of(best, best.gain * (1.0 + 0.05 * rng.standard_normal(5)), start)
        assert other > optimal


@pytest.mark.parametrize("bandwidth", [1.0, 3.0, 6.0])
def test_a_quick_attitude_gets_poles_at_the_bandwidth(bandwidth):
    quick = Actuation(400.0, 1.0, 0.0)
    gains = feedback(weights(bandwidth, 0.0, 0.002), NominalPlant(quick, quick, 0.0))
    slow = sorted(poles(NominalPlant(quick, quick, 0.0), 0, gains[0], 0.002), key=abs)[:2]
    for pole in slow:
        assert abs(pole) == pytest.approx(bandwidth, rel=0.05)
        assert -pole.real / abs(pole) == pytest.approx(math.sqrt(0.5), abs=0.05)


@pytest.mark.parametrize("bandwidth", [0.5, 1.0, 2.0])
def test_a_quick_climb_rate_gets_one_pole_at_the_bandwidth(bandwidth):
    quick = Actuation(150.0, 1.0, 0.0, "climb_rate")
    plant = NominalPlant(quick, quick, 0.0)
    gains = feedback(weights(bandwidth, 0.0, 0.002), plant)
    assert min(abs(p) for p in poles(plant, 2, gains[2], 0.002)) == pytest.approx(
        bandwidth, rel=0.06
    )


@settings(deadline=None, derandomize=True, max_examples=20)
@given(plants, st.floats(1.0, 9.0))
def test_a_longer_rate_time_keeps_noise_out_of_the_rate(plant, bandwidth):
    calm, quick = (feedback(weights(bandwidth, tau), plant) for tau in (0.2, 0.02))
    assert (np.abs(calm[:, :2]).sum(axis=1) < np.abs(quick[:, :2]).sum(axis=1)).all()


@pytest.mark.parametrize(("plant", "given"), [(THRUSTING, SHIPPED), (CLIMBING, OVER_A_CLIMB_RATE)])
def test_every_pole_is_well_damped(plant, given):
    gains = feedback(given, plant)
    for axis in range(3):
        for pole in poles(plant, axis, gains[axis]):
            assert -pole.real / abs(pole) > 0.4


def test_both_horizontal_axes_are_alike():
    gains = feedback(SHIPPED, THRUSTING)
    assert (gains[0] == gains[1]).all()


def test_numbers_that_no_gain_can_be_made_of_are_refused():
    with pytest.raises(ValueError, match="axis x: take a bandwidth"):
        riccati(weights(1e-4, 0.05), THRUSTING, 0)
