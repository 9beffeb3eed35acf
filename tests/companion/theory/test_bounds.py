import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.config.models import VehicleConfig
from companion.config.resolve import find_config
from companion.config.validation import validate
from companion.config.yaml_source import read_yaml
from companion.control import l1_adaptive
from companion.control.l1_adaptive import L1Gains
from companion.control.matrix_exponential import matrix_exponential
from companion.control.transfer_function import TransferFunction, first_order
from companion.theory.bounds import gamma_0, gamma_1, lyapunov_pair
from companion.theory.envelope import Air, ThrustLoop, horizontal_bounds, vertical_bounds

LAW = settings(deadline=None, derandomize=True, max_examples=25)
MODELS = [
    first_order(0.5),
    first_order(4.0),
    TransferFunction((2.0, 3.0), (1.0, 4.0, 3.0)),
    TransferFunction((1.0, 5.0, 6.0), (1.0, 5.9, 10.9, 6.0)),
]


@LAW
@given(st.floats(0.1, 10.0), st.floats(1.0, 1e5), st.floats(0.1, 50.0), st.floats(0.0, 500.0))
def test_gamma_0_of_a_first_order_model(m, gamma, delta, delta_d):
    expected = math.sqrt((4.0 * m * delta**2 + 2.0 * delta * delta_d) / gamma)
    assert gamma_0(first_order(m), gamma, delta, delta_d) == pytest.approx(expected, rel=1e-9)


def test_gamma_0_falls_with_the_root_of_the_rate():
    for model in MODELS:
        ratio = gamma_0(model, 100.0, 3.0, 20.0) / gamma_0(model, 10_000.0, 3.0, 20.0)
        assert ratio == pytest.approx(10.0, rel=1e-6)


def test_a_model_with_a_cancelled_pole_is_bounded_as_well_as_without():
    with_pole = TransferFunction((2.0, 2.0), (1.0, 3.0, 2.0))  # 2 / (s + 2)
    plain = gamma_0(first_order(2.0), 300.0, 16.0, 90.0)
    assert gamma_0(with_pole, 300.0, 16.0, 90.0) >= plain


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("seed", range(4))
def test_no_disturbance_within_the_inputs_brings_the_estimation_error_over_gamma_0(model, seed):
    """The implemented law, against σ that runs between ±Δ at the rate of Δ_d."""
    rng = np.random.default_rng(seed)
    gamma, delta, step_s = 200.0, 2.0, 0.002
    delta_d = [2.0, 10.0, 40.0, 150.0][seed]
    bound = delta * math.sqrt(1.1)  # so that the projection leaves |σ̂| ≤ Δ free
    c = TransferFunction((1.0,), (1.0, 1.0))
    gains = L1Gains((model,), (c,), (0.0,), (gamma,), (bound,))
    a, b, _ = model.state_space()
    n = len(b)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n], system[:n, n] = a, b
    advance = matrix_exponential(system * step_s)
    zero = np.zeros(1)
    memory = l1_adaptive.start(gains, zero, zero)
    x, sigma, direction, largest = np.zeros(n + 1), 0.0, 1.0, 0.0
    mode_s = math.pi / math.sqrt(gamma * b[0])
    for k in range(4_000):
        # Worst at resonance: turn round every half period of the adaptation mode, or at random.
        if k * step_s % mode_s < step_s and (seed % 2 == 0 or rng.random() < 0.8):
            direction = -direction
        sigma = max(-delta, min(delta, sigma + direction * delta_d * step_s))
        x[-1] = sigma
        x = advance @ x
        memory, record = l1_adaptive.step(gains, memory, zero, zero, x[:1], step_s)
        memory = l1_adaptive.with_applied(gains, memory, zero)
        largest = max(largest, abs(float(record.y_tilde_m_s[0])))
    limit = gamma_0(model, gamma, bound, delta_d)
    assert limit is not None
    assert 0.01 * limit < largest < limit


def test_what_was_found_for_a_model_of_higher_order_is_a_lyapunov_function():
    for model in MODELS[2:]:
        pair = lyapunov_pair(model, 2.0, 20.0)
        assert pair is not None
        # C P⁻¹ Cᵀ = C B for every P with P B = Cᵀ.
        _, b, c = model.state_space()
        assert pair.output_gain == pytest.approx(float(c @ b), rel=1e-6)
        # No slower than half the slowest pole allows.
        assert pair.slowness_s >= 0.5 / -np.roots(model.denominator).real.max() - 1e-6


def test_a_model_that_is_not_positive_real_has_none():
    assert lyapunov_pair(TransferFunction((-1.0, 2.0), (1.0, 2.0, 2.0))) is None


def test_gamma_1_is_the_papers_and_infinite_without_the_norm_condition():
    assert gamma_1(1.7, 5.0, 0.03, 2.0) == pytest.approx(1.7 / 0.85 * 2.0)
    assert gamma_1(1.7, 5.0, 0.2, 2.0) == math.inf


# What σ and the drag can be


def vehicle(name="bebop2") -> VehicleConfig:
    return validate(VehicleConfig, read_yaml(find_config("vehicle", name)))


@pytest.mark.parametrize("wind", [0.0, 4.5, 9.0])
def test_the_lipschitz_constant_is_that_of_the_quadratic_drag(wind):
    v = vehicle()
    k2 = v.dynamics.quadratic_drag_1_m
    air = Air(wind_m_s=wind)
    m, c = first_order(0.5), first_order(0.2)
    horizontal = horizontal_bounds(v, v.dynamics, air, m, c, 16.0).lipschitz * 9.80665
    vertical = vertical_bounds(v, v.dynamics, air, ThrustLoop(4.0, 4.0), m, c, 8.0).lipschitz * 4.0
    rng = np.random.default_rng(1)
    steepest = 0.0
    for _ in range(2000):
        still = rng.standard_normal(3)
        still *= v.speed_limit_m_s * rng.random() ** 0.1 / np.linalg.norm(still)
        blown = rng.standard_normal(3)
        blown *= wind / np.linalg.norm(blown)
        other = still + 1e-4 * rng.standard_normal(3)

        def drag(velocity, blown=blown):
            return k2 * np.linalg.norm(velocity - blown) * (velocity - blown)

        change = np.linalg.norm(drag(other) - drag(still)) / np.linalg.norm(other - still)
        steepest = max(steepest, change)
    assert 0.8 * horizontal < steepest <= horizontal * (1.0 + 1e-4)
    assert steepest <= vertical * (1.0 + 1e-4)


@pytest.mark.parametrize("name", ["bebop2", "x500", "sih_quadx"])
@pytest.mark.parametrize("seed", range(3))
def test_sigma_and_its_rate_stay_within_their_bounds_on_the_model(name, seed):
    """A vehicle in one dimension, tilted at will by u = C(s) of a rough input, in a rough wind."""
    v, air = vehicle(name), Air()
    d, m, omega, delta = v.dynamics, 0.5, 0.2, 16.0
    bounds = horizontal_bounds(v, d, air, first_order(m), first_order(omega), delta)
    sine = math.sin(math.radians(v.tilt_limit_deg))
    wn, zeta = d.attitude.natural_frequency_rad_s, d.attitude.damping
    rng = np.random.default_rng(seed)
    step = 0.002
    speed = tilt = tilt_rate = u = wind = 0.0
    target, gust = 1.0, 1.0
    sigmas, rates, last = [], [], None
    for k in range(15_000):
        if k % 300 == 0:
            # r1 - σ̂ at its largest, towards what does not leave the speed limit.
            target = rng.choice([-1.0, 1.0]) if abs(speed) < 0.6 * v.speed_limit_m_s else -speed
            target = math.copysign(bounds.r1_m_s + delta, target)
            gust = rng.choice([-1.0, 1.0])
        u_rate = omega * (target - u)
        u_new = max(-sine, min(sine, u + step * u_rate))
        wind = max(-air.wind_m_s, min(air.wind_m_s, wind + step * gust * air.wind_change_m_s2))
        against = speed - wind
        drag = (d.linear_drag_1_s + d.quadratic_drag_1_m * abs(against)) * against
        acceleration = 9.80665 * tilt - drag
        if abs(speed) <= v.speed_limit_m_s:
            sigma = speed + acceleration / m - u
            sigmas.append(abs(sigma))
            if last is not None:
                rates.append(abs(sigma - last) / step)
            last = sigma
        else:
            last = None
        u = u_new
        tilt_rate += step * (wn * wn * (u - tilt) - 2.0 * zeta * wn * tilt_rate)
        tilt += step * tilt_rate
        speed += step * acceleration
    assert 0.2 * bounds.sigma < max(sigmas) <= bounds.sigma
    assert 0.1 * bounds.sigma_rate < max(rates) <= bounds.sigma_rate
