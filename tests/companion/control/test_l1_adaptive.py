"""The L1 law: exactness of its discretisation, projection, bumpless start, and what it does."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control import l1_adaptive
from companion.control.l1_adaptive import L1Gains, first_order_gains
from companion.control.transfer_function import TransferFunction, first_order

M = (0.5, 0.5, 3.75)
GAINS = first_order_gains(
    m=M,
    omega=(0.25, 0.25, 4.0),
    gain_k=(0.8, 0.8, 0.55),
    gamma=(500.0, 500.0, 1000.0),
    sigma_bound=(8.0, 8.0, 8.0),
)


def integrate_finely(gains, memory, u, y_before, y_after, dt, pieces=20000):
    """Predictor and adaptation law by tiny RK4 steps, velocity linear in time, no projection."""
    m, gamma = np.array(M), np.array(gains.gamma)
    y, sigma = memory.predictor[:, 0].copy(), memory.sigma_hat.copy()
    h = dt / pieces

    def rate(y, sigma, t):
        velocity = y_before + (y_after - y_before) * t / dt
        return -m * y + m * (u + sigma), -gamma * (y - velocity)

    for k in range(pieces):
        t = k * h
        a1, b1 = rate(y, sigma, t)
        a2, b2 = rate(y + h / 2 * a1, sigma + h / 2 * b1, t + h / 2)
        a3, b3 = rate(y + h / 2 * a2, sigma + h / 2 * b2, t + h / 2)
        a4, b4 = rate(y + h * a3, sigma + h * b3, t + h)
        y = y + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        sigma = sigma + h / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
    return y, sigma


@pytest.mark.parametrize("dt", [0.004, 0.01, 0.05])
def test_a_step_is_exact_for_any_interval(dt):
    memory = l1_adaptive.start(GAINS, np.array([0.3, -0.2, 0.1]), np.array([0.05, -0.02, 0.1]))
    after = np.array([0.35, -0.15, 0.05])
    expected_y, expected_sigma = integrate_finely(
        GAINS, memory, memory.applied_u, memory.last_velocity_m_s, after, dt, pieces=2000
    )
    advanced, _ = l1_adaptive.step(GAINS, memory, np.zeros(3), np.zeros(3), after, dt)
    np.testing.assert_allclose(advanced.predictor[:, 0], expected_y, atol=1e-9)
    np.testing.assert_allclose(advanced.sigma_hat, expected_sigma, atol=1e-7)


@settings(deadline=None, derandomize=True, max_examples=50)
@given(
    first=st.integers(4, 25), second=st.integers(4, 25), velocity=st.floats(-2, 2, allow_nan=False)
)
def test_two_steps_under_a_constant_velocity_equal_one_of_their_sum(first, second, velocity):
    """The law of composition of an exact discretisation, for what is held over both."""
    start = l1_adaptive.start(GAINS, np.full(3, velocity), np.array([0.1, -0.1, 0.2]))
    y = np.full(3, velocity)
    one, _ = l1_adaptive.step(GAINS, start, y, y, y, (first + second) * 1e-3)
    half, _ = l1_adaptive.step(GAINS, start, y, y, y, first * 1e-3)
    held = l1_adaptive.with_applied(GAINS, half, start.applied_u)
    two, _ = l1_adaptive.step(GAINS, held, y, y, y, second * 1e-3)
    np.testing.assert_allclose(two.predictor[:, 0], one.predictor[:, 0], atol=1e-9)
    np.testing.assert_allclose(two.sigma_hat, one.sigma_hat, atol=1e-7)


def test_it_starts_without_a_bump():
    """At rest in its own terms: nothing moves until the reference or the velocity does."""
    velocity, u = np.array([0.4, -0.3, 0.2]), np.array([0.05, 0.1, 0.2])
    memory = l1_adaptive.start(GAINS, velocity, u)
    position = np.array([1.0, 2.0, 3.0])
    r2 = position + velocity / np.array(GAINS.gain_k)
    advanced, record = l1_adaptive.step(GAINS, memory, r2, position, velocity, 0.01)
    np.testing.assert_allclose(record.y_tilde_m_s, 0.0, atol=1e-9)
    np.testing.assert_allclose(record.u, u, atol=1e-9)
    np.testing.assert_allclose(advanced.low_pass[:, 0], u, atol=1e-9)


def test_a_constant_disturbance_is_cancelled():
    """On y1' = -m y1 + m (u + d) the law brings y1 to r1 whatever d is: C(0) = 1."""
    gains = first_order_gains((0.5,), (2.0,), (1.0,), (1000.0,), (8.0,))
    memory = l1_adaptive.start(gains, np.zeros(1), np.zeros(1))
    y, disturbance, dt = np.zeros(1), 0.7, 0.01
    r1 = 0.3
    for _ in range(6000):
        memory, record = l1_adaptive.step(gains, memory, np.array([r1]), np.zeros(1), y, dt)
        y = y + dt * 0.5 * (-y + record.u + disturbance)
    assert y[0] == pytest.approx(r1, abs=1e-3)
    assert memory.sigma_hat[0] == pytest.approx(disturbance, abs=1e-2)


@settings(deadline=None, derandomize=True, max_examples=60)
@given(
    velocities=st.lists(st.floats(-50, 50, allow_nan=False), min_size=5, max_size=40),
    dt_ms=st.integers(4, 50),
)
def test_the_estimate_never_leaves_its_bound(velocities, dt_ms):
    memory = l1_adaptive.start(GAINS, np.zeros(3), np.zeros(3))
    for velocity in velocities:
        memory, record = l1_adaptive.step(
            GAINS, memory, np.zeros(3), np.zeros(3), np.full(3, velocity), dt_ms * 1e-3
        )
        assert (np.abs(memory.sigma_hat) <= np.array(GAINS.sigma_bound) + 1e-12).all()
        assert np.isfinite(record.u).all()


def test_projection_says_that_it_acts_and_lets_go_again():
    """A velocity that runs away from any prediction drives the estimate to its bound."""
    memory = l1_adaptive.start(GAINS, np.zeros(3), np.zeros(3))
    acted = False
    velocity = np.zeros(3)
    for _ in range(200):
        velocity = velocity + 0.2
        memory, record = l1_adaptive.step(GAINS, memory, velocity, np.zeros(3), velocity, 0.01)
        memory = l1_adaptive.with_applied(GAINS, memory, np.zeros(3))
        acted = acted or record.projecting
    assert acted
    assert memory.sigma_hat[0] > 7.0
    for _ in range(1500):
        memory, record = l1_adaptive.step(
            GAINS, memory, np.zeros(3), np.zeros(3), np.zeros(3), 0.01
        )
        memory = l1_adaptive.with_applied(GAINS, memory, np.zeros(3))
    assert not record.projecting
    assert abs(memory.sigma_hat[0]) < 1.0


def euler_step(gains, y_hat, sigma, u, velocity, dt):
    """The same law by an explicit Euler step, for comparison."""
    m, gamma = M[0], gains.gamma[0]
    y_next = y_hat + dt * (-m * y_hat + m * (u + sigma))
    return y_next, sigma - dt * gamma * (y_hat - velocity)


def test_the_exact_step_stays_calm_where_explicit_euler_diverges():
    """m Γ dt² = 12.5: Euler's growth per step is beyond 1 for any dt, and violent here."""
    gains, dt = GAINS, 0.05
    memory = l1_adaptive.start(GAINS, np.zeros(3), np.zeros(3))
    y_hat, sigma = 0.0, 0.0
    for _ in range(200):
        memory = l1_adaptive.with_applied(GAINS, memory, np.zeros(3))
        memory, _ = l1_adaptive.step(gains, memory, np.zeros(3), np.zeros(3), np.full(3, 0.1), dt)
        y_hat, sigma = euler_step(gains, y_hat, sigma, 0.0, 0.1, dt)
        y_hat, sigma = float(np.clip(y_hat, -1e9, 1e9)), float(np.clip(sigma, -1e9, 1e9))
    assert abs(memory.predictor[0, 0] - 0.1) < 0.01
    assert abs(y_hat) > 1e6


# General M(s) and C(s)

SECOND_ORDER_M = TransferFunction((1.5, 1.0), (1.0, 2.0, 1.0))
SECOND_ORDER_C = TransferFunction((4.0,), (1.0, 2.8, 4.0))


def test_axes_of_different_orders_do_not_touch_each_other():
    """One law over three axes is three laws of one axis."""
    models = (first_order(0.5), SECOND_ORDER_M, first_order(3.0))
    filters = (SECOND_ORDER_C, first_order(2.0), SECOND_ORDER_C)
    rest = ((0.8, 0.7, 0.6), (300.0, 200.0, 1000.0), (0.5, 8.0, 8.0))
    whole = L1Gains(models, filters, *rest)
    parts = [
        L1Gains((models[i],), (filters[i],), *((values[i],) for values in rest)) for i in range(3)
    ]
    rng = np.random.default_rng(1)
    velocity, u = rng.standard_normal(3), rng.standard_normal(3) * 0.1
    together = l1_adaptive.start(whole, velocity, u)
    apart = [l1_adaptive.start(p, velocity[[i]], u[[i]]) for i, p in enumerate(parts)]
    for _ in range(60):
        velocity, r2, position = rng.standard_normal((3, 3))
        together, record = l1_adaptive.step(whole, together, r2, position, velocity, 0.01)
        for i, part in enumerate(parts):
            apart[i], one = l1_adaptive.step(
                part, apart[i], r2[[i]], position[[i]], velocity[[i]], 0.01
            )
            np.testing.assert_allclose(one.u[0], record.u[i], atol=1e-12)
            np.testing.assert_allclose(one.sigma_hat[0], record.sigma_hat[i], atol=1e-12)


@pytest.mark.parametrize("model", [first_order(0.5), SECOND_ORDER_M])
@pytest.mark.parametrize("low_pass", [first_order(2.0), SECOND_ORDER_C])
def test_a_constant_disturbance_is_cancelled_for_any_model_and_filter(model, low_pass):
    """On y1 = M(s) (u + d) the velocity ends at r1, and σ̂ at d."""
    gains = L1Gains((model,), (low_pass,), (1.0,), (1000.0,), (8.0,))
    memory = l1_adaptive.start(gains, np.zeros(1), np.zeros(1))
    a, b, c = model.state_space()
    state, dt = np.zeros(model.order), 0.002
    for _ in range(15000):
        memory, record = l1_adaptive.step(
            gains, memory, np.array([0.3]), np.zeros(1), np.array([c @ state]), dt
        )
        state = state + dt * (a @ state + b * (record.u[0] + 0.7))
    assert c @ state == pytest.approx(0.3, abs=1e-3)
    assert memory.sigma_hat[0] == pytest.approx(0.7, abs=1e-2)


def test_a_general_law_starts_without_a_bump_and_takes_what_was_applied():
    gains = L1Gains((SECOND_ORDER_M,), (SECOND_ORDER_C,), (1.0,), (300.0,), (8.0,))
    velocity, u = np.array([0.4]), np.array([0.1])
    memory = l1_adaptive.start(gains, velocity, u)
    r2 = velocity / 1.0
    memory, record = l1_adaptive.step(gains, memory, r2, np.zeros(1), velocity, 0.01)
    np.testing.assert_allclose(record.u, u, atol=1e-9)
    np.testing.assert_allclose(record.y_tilde_m_s, 0.0, atol=1e-9)
    held = l1_adaptive.with_applied(gains, memory, np.array([0.02]))
    assert held.low_pass[0, 0] == held.applied_u[0] == 0.02


@pytest.mark.parametrize(
    ("model", "low_pass", "says"),
    [
        (TransferFunction((1.0,), (1.0, 1.0, 1.0)), first_order(1.0), "strictly positive real"),
        (TransferFunction((1.0,), (1.0, 2.0)), first_order(1.0), "gain 1"),
        (first_order(1.0), TransferFunction((1.0,), (1.0, -1.0)), "stable"),
        (first_order(1.0), TransferFunction((1.0,), (1.0, 2.0)), r"C\(0\)"),
    ],
)
def test_models_and_filters_that_the_law_is_not_made_for_are_refused(model, low_pass, says):
    with pytest.raises(ValueError, match=says):
        L1Gains((model,), (low_pass,), (1.0,), (1.0,), (1.0,))


@settings(deadline=None, derandomize=True)
@given(zero=st.floats(0.05, 20), damping=st.floats(0.05, 3), frequency=st.floats(0.2, 20))
def test_strict_positive_realness_agrees_with_the_frequency_response(zero, damping, frequency):
    """(s + z) / (s² + 2 ζ ω s + ω²) is strictly positive real exactly for z < 2 ζ ω."""
    sum_of_poles = 2.0 * damping * frequency
    function = TransferFunction((1.0, zero), (1.0, sum_of_poles, frequency**2))
    if abs(zero - sum_of_poles) > 1e-6:
        assert function.strictly_positive_real == (zero < sum_of_poles)


def test_the_euler_step_can_be_chosen_and_is_the_textbook_one():
    gains = replace(GAINS, discretisation="euler")
    memory = l1_adaptive.start(gains, np.array([0.3, -0.2, 0.1]), np.array([0.05, -0.02, 0.1]))
    memory = replace(memory, sigma_hat=memory.sigma_hat + 0.1)
    expected = euler_step(
        gains, memory.predictor[0, 0], memory.sigma_hat[0], memory.applied_u[0], 0.3, 0.01
    )
    after, _ = l1_adaptive.step(gains, memory, np.zeros(3), np.zeros(3), np.full(3, 0.9), 0.01)
    np.testing.assert_allclose((after.predictor[0, 0], after.sigma_hat[0]), expected, atol=1e-12)


@pytest.mark.parametrize("low_pass", [first_order(2.0), SECOND_ORDER_C])
def test_u_leaves_a_limit_as_soon_as_the_law_wants_it_whatever_the_order_of_the_filter(low_pass):
    """Two seconds at a limit of 0.5 under a demand far beyond it, then the opposite."""
    gains = L1Gains((first_order(0.5),), (low_pass,), (1.0,), (300.0,), (8.0,))
    memory = l1_adaptive.start(gains, np.zeros(1), np.zeros(1))
    zero, waited = np.zeros(1), 0
    for k in range(400):
        wanted = np.array([30.0 if k < 200 else -30.0])
        memory, record = l1_adaptive.step(gains, memory, wanted, zero, zero, 0.01)
        applied = np.clip(record.u, -0.5, 0.5)
        memory = l1_adaptive.with_applied(gains, memory, applied)
        waited += k >= 200 and applied[0] >= 0.5
    assert waited <= 5
