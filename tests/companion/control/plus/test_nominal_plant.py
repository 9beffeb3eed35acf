"""The nominal plant: its motion over any time, under any inputs meanwhile."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.plus.nominal_plant import Acting, carry, discrete
from tests.companion.control.plus.examples import CLIMBING, THRUSTING, plants, vectors

BOTH = pytest.mark.parametrize("plant", [THRUSTING, CLIMBING], ids=["thrust", "climb rate"])
half_milliseconds = st.integers(1, 200).map(lambda n: n * 5e-4)
states = vectors(3.0, 12).map(lambda x: x.reshape(3, 4))


@st.composite
def inputs(draw):
    """Inputs that begin to act one after the other, each axis a little apart."""
    now, found = -0.05, []
    apart = draw(st.lists(st.integers(0, 40), min_size=3, max_size=3))
    for gap in draw(st.lists(half_milliseconds, min_size=1, max_size=6)):
        found.append(Acting(tuple(now + 5e-4 * a for a in apart), tuple(draw(vectors(3.0)))))
        now += gap
    return tuple(found)


@settings(deadline=None, derandomize=True, max_examples=50)
@given(plants, st.integers(0, 200_000), st.integers(0, 200_000))
def test_two_times_in_a_row_are_their_sum(plant, first, second):
    a1, b1 = discrete(plant, first)
    a2, b2 = discrete(plant, second)
    a, b = discrete(plant, first + second)
    assert a2 @ a1 == pytest.approx(a, rel=1e-9, abs=1e-9)
    assert a2 @ b1 + b2 == pytest.approx(b, rel=1e-9, abs=1e-9)


def derivative(actuation, drag, x, u, sigma):
    """The model as the module's description states it, written out anew."""
    _, v, a, rate = x
    omega, zeta = actuation.natural_frequency_rad_s, actuation.damping
    if actuation.interface == "acceleration":
        answer = omega**2 * (u - a) - 2.0 * zeta * omega * rate
        return np.array([v, a - drag * v + sigma, rate, answer])
    return np.array([v, a + sigma, omega**2 * (u - v) - 2.0 * zeta * omega * a, 0.0])


def runge_kutta(actuation, drag, x, u, sigma, time_s, steps=400):
    h = time_s / steps
    for _ in range(steps):
        k1 = derivative(actuation, drag, x, u, sigma)
        k2 = derivative(actuation, drag, x + 0.5 * h * k1, u, sigma)
        k3 = derivative(actuation, drag, x + 0.5 * h * k2, u, sigma)
        k4 = derivative(actuation, drag, x + h * k3, u, sigma)
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return x


@BOTH
@pytest.mark.parametrize("axis", [0, 2])
def test_it_moves_by_the_stated_equations(plant, axis):
    x = np.array([0.3, -0.7, 1.1, 0.0])
    a, b = discrete(plant, 300_000)
    wanted = runge_kutta(plant.axes[axis], plant.linear_drag_1_s, x, 0.8, -0.4, 0.3)
    got = a[axis] @ x + b[axis] @ [0.8, -0.4]
    used = 4 if plant.axes[axis].interface == "acceleration" else 3
    assert got[:used] == pytest.approx(wanted[:used], abs=1e-6)


@settings(deadline=None, derandomize=True, max_examples=50)
@given(
    plants,
    states,
    vectors(2.0),
    inputs(),
    half_milliseconds,
    st.lists(half_milliseconds, min_size=3, max_size=3),
)
def test_carried_in_two_parts_is_carried_in_one(plant, x, sigma, acting, half, rest):
    ends = tuple(half + r for r in rest)
    midway = carry(plant, x, sigma, 0.0, (half, half, half), acting)
    assert carry(plant, midway, sigma, half, ends, acting) == pytest.approx(
        carry(plant, x, sigma, 0.0, ends, acting), rel=1e-8, abs=1e-8
    )


@settings(deadline=None, derandomize=True, max_examples=50)
@given(plants, vectors(5.0), vectors(2.0), half_milliseconds)
def test_rest_stays_rest(plant, position, sigma, time_s):
    """Where the input cancels what pushes the vehicle, and the actuation has settled on that."""
    x = np.zeros((3, 4))
    x[:, 0], x[:, 2] = position, -sigma
    u = -sigma
    if plant.vertical.interface == "climb_rate":
        u[2] *= plant.vertical.lag_s
    acting = (Acting((0.0, 0.0, 0.0), tuple(u)),)
    later = carry(plant, x, sigma, 0.0, (time_s, time_s, time_s), acting)
    assert later == pytest.approx(x, abs=1e-9)


@settings(deadline=None, derandomize=True, max_examples=30)
@given(plants, vectors(3.0))
def test_the_gain_is_one(plant, u):
    """An axis settles on the acceleration, or the climb rate, that is asked for."""
    acting = (Acting((0.0, 0.0, 0.0), tuple(u)),)
    later = carry(plant, np.zeros((3, 4)), np.zeros(3), 0.0, (8.0, 8.0, 8.0), acting)
    reached = later[:, 2]
    if plant.vertical.interface == "climb_rate":
        reached[2] = later[2, 1]
    assert reached == pytest.approx(u, abs=1e-5)


@BOTH
def test_a_state_is_not_carried_backwards(plant):
    x = np.arange(12.0).reshape(3, 4)
    acting = (Acting((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),)
    assert (carry(plant, x, np.zeros(3), 1.0, (1.0, 0.5, 1.0), acting) == x).all()


@BOTH
def test_carrying_leaves_its_input_alone(plant):
    x = np.ones((3, 4))
    acting = (Acting((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),)
    carry(plant, x, np.zeros(3), 0.0, (0.1, 0.1, 0.1), acting)
    assert (x == 1.0).all()


@BOTH
def test_before_the_first_input_it_acts_already(plant):
    x = np.zeros((3, 4))
    known = Acting((0.05, 0.05, 0.05), (1.0, -1.0, 0.5))
    earlier = Acting((-1.0, -1.0, -1.0), known.u)
    ends = (0.1, 0.1, 0.1)
    assert carry(plant, x, np.zeros(3), 0.0, ends, (known,)) == pytest.approx(
        carry(plant, x, np.zeros(3), 0.0, ends, (earlier,))
    )


@settings(deadline=None, derandomize=True)
@given(plants, st.floats(0.5, 2.5))
def test_a_slower_attitude_lags_more_and_nothing_else_changes(plant, scale):
    slower = plant.lagging(scale)
    assert slower.tilt.lag_s == pytest.approx(scale * plant.tilt.lag_s)
    assert slower.tilt.damping == plant.tilt.damping
    assert slower.tilt.delay_s == plant.tilt.delay_s
    assert (slower.vertical, slower.linear_drag_1_s) == (plant.vertical, plant.linear_drag_1_s)


def test_a_ramp_comes_through_late_by_the_stated_lag():
    lag = THRUSTING.tilt.lag_s
    acting = tuple(Acting((t, t, t), (t + 5e-3, 0.0, 0.0)) for t in np.arange(0.0, 3.0, 0.01))
    x = carry(THRUSTING, np.zeros((3, 4)), np.zeros(3), 0.0, (3.0, 3.0, 3.0), acting)
    assert 3.0 - x[0, 2] == pytest.approx(lag, rel=1e-3)
    assert x[0, 3] == pytest.approx(1.0, rel=2e-3)  # the ramp is one of stairs


def test_each_axis_takes_its_own_inputs_at_its_own_times():
    acting = tuple(
        Acting((t, t + 0.02, t + 0.04), (t, 2.0 * t, 3.0 * t)) for t in np.arange(0.0, 0.2, 0.01)
    )
    assert all(one.from_s < other.from_s for one, other in pairwise(acting))
    ends = (0.1, 0.12, 0.14)
    together = carry(THRUSTING, np.zeros((3, 4)), np.zeros(3), 0.0, ends, acting)
    for i in range(3):
        alone = tuple(Acting((a.from_s[i],) * 3, (a.u[i],) * 3) for a in acting)
        wanted = carry(THRUSTING, np.zeros((3, 4)), np.zeros(3), 0.0, (ends[i],) * 3, alone)
        assert together[i] == pytest.approx(wanted[i], abs=1e-12)
