import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.transfer_function import TransferFunction, first_order
from companion.theory.loops import (
    AxisLoop,
    h_is_stable,
    pade,
    poles_of_h,
    whole_loop_is_stable,
)
from companion.theory.nyquist import unstable_zeros
from companion.theory.plant import AxisPlant, evaluate, imaginary
from tests.companion.theory.loops_for_tests import horizontal, loop_of

LAW = settings(deadline=None, derandomize=True, max_examples=40)
S = imaginary(np.geomspace(0.02, 200.0, 60))
SECOND_ORDER_C = TransferFunction((1.2, 0.36), (1.0, 1.2, 0.36))
SECOND_ORDER_M = TransferFunction((2.0, 3.0), (1.0, 4.0, 3.0))


@pytest.mark.parametrize("low_pass", [first_order(0.3), SECOND_ORDER_C])
@pytest.mark.parametrize("model", [first_order(0.7), SECOND_ORDER_M])
def test_h_and_g_are_those_of_the_papers_block_diagram(model, low_pass):
    """Its equations for y1, u and σ are solved as they stand there."""
    loop = AxisLoop(horizontal(), model, low_pass, 0.7, 300.0)
    a, m, c = loop.plant.at(S), evaluate(model, S), evaluate(low_pass, S)
    for r1, d in ((1.0, 0.0), (0.0, 1.0), (0.3, -2.0)):
        for k, s in enumerate(S):
            # Unknowns y1, u, σ.
            equations = np.array(
                [[1.0, -m[k], -m[k]], [0.0, 1.0, c[k]], [0.0, -(a[k] - m[k]) / m[k], 1.0]]
            )
            y1 = np.linalg.solve(equations, np.array([0.0, c[k] * r1, a[k] / m[k] * d]))[0]
            h, g = loop.h(np.array([s]))[0], loop.g(np.array([s]))[0]
            assert h * c[k] * r1 + g * d == pytest.approx(y1, rel=1e-9)
    assert np.allclose(loop.ch_over_m(S), c * loop.h(S) / m, rtol=1e-12)


@pytest.mark.parametrize("gamma", [50.0, 300.0, 5000.0])
def test_the_loop_broken_at_u_is_that_of_predictor_and_adaptation_law(gamma):
    loop = loop_of(horizontal(), gamma=gamma)
    a, m = loop.plant.at(S), evaluate(loop.model, S)
    c = evaluate(loop.low_pass, S)
    for k, s in enumerate(S):
        # With y1 = A v given by the plant's input v = 1: unknowns ŷ, σ̂, u.
        equations = np.array(
            [[1.0, -m[k], -m[k]], [gamma / s, 1.0, 0.0], [0.0, c[k], 1.0]], dtype=complex
        )
        y = a[k]
        right = np.array([0.0, gamma / s * y, -c[k] * loop.gain_k * y / s])
        u = np.linalg.solve(equations, right)[2]
        assert -loop.broken_at_u(np.array([s]))[0] == pytest.approx(u, rel=1e-9)


@LAW
@given(st.floats(0.3, 2.0), st.floats(0.05, 4.0), st.floats(0.0, 0.1))
def test_the_count_with_the_exact_delay_agrees_with_the_poles(m, omega, delay_s):
    loop = loop_of(horizontal(delay_s=delay_s), m=m, omega=omega)
    slowest = poles_of_h(loop, pade_order=8)[0].real
    if abs(slowest) > 0.02:  # clear of the boundary
        assert h_is_stable(loop) == (slowest < 0.0)


def test_unstable_poles_are_counted_and_not_only_noticed():
    # (s - 1)² (s - 2) / (s + 3)³ has three zeros in the right half plane.
    assert unstable_zeros(lambda s: (s - 1) ** 2 * (s - 2) / (s + 3) ** 3) == 3
    assert unstable_zeros(lambda s: ((s - 1) ** 2 + 25) / (s + 3) ** 2) == 2
    assert unstable_zeros(lambda s: (s + 1) / (s + 3)) == 0
    assert unstable_zeros(lambda s: (s**2 + 4) / (s + 1) ** 2) is None
    with pytest.raises(ValueError, match="roll off"):
        unstable_zeros(lambda s: 2.0 + 0.0 * s)


def test_a_delay_is_what_makes_it_unstable():
    assert h_is_stable(loop_of(horizontal(delay_s=0.0), m=0.5, omega=0.6))
    assert not h_is_stable(loop_of(horizontal(delay_s=0.2), m=0.5, omega=0.6))


def test_the_papers_loop_needs_its_adaptation_rate():
    assert whole_loop_is_stable(loop_of(horizontal(), gamma=300.0))
    assert not whole_loop_is_stable(loop_of(horizontal(), gamma=50.0))


def test_an_integrator_in_the_plant_is_counted_rightly():
    plant = horizontal(drag=0.0)
    assert plant.integrators == 1
    assert h_is_stable(loop_of(plant))
    assert whole_loop_is_stable(loop_of(plant))
    assert not h_is_stable(loop_of(plant, omega=2.0))
    assert poles_of_h(loop_of(plant))[0].real < 0.0


@pytest.mark.parametrize("denominator", [(1.0, -0.5), (1.0, 0.0, 0.0)])
def test_a_plant_that_the_tests_are_not_made_for_is_refused(denominator):
    with pytest.raises(ValueError, match="stable"):
        AxisPlant(TransferFunction((1.0,), denominator), 0.0)


@LAW
@given(st.floats(0.001, 0.2))
def test_pade_follows_the_delay_up_to_its_order(delay_s):
    numerator, denominator = pade(delay_s, 5)
    s = imaginary(np.linspace(0.0, 3.0 / delay_s, 20))
    assert np.allclose(
        np.polyval(numerator, s) / np.polyval(denominator, s), np.exp(-s * delay_s), atol=1e-4
    )
    assert pade(0.0, 5) == ([1.0], [1.0])
