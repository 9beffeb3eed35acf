import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.theory import norms
from companion.theory.loops import poles_of_h
from tests.companion.theory.loops_for_tests import horizontal, loop_of

LAW = settings(deadline=None, derandomize=True, max_examples=25)


def second_order_norm(zeta: float) -> float:
    """Of ω² / (s² + 2 ζ ω s + ω²): lobes of alternating sign that shrink by exp(-πζ/√(1-ζ²))."""
    if zeta >= 1.0:
        return 1.0
    return 1.0 / np.tanh(0.5 * np.pi * zeta / np.sqrt(1.0 - zeta**2))


@LAW
@given(st.floats(0.01, 100.0))
def test_a_first_order_low_pass_has_the_norm_1(m):
    assert norms.of_rational((m,), (1.0, m)) == pytest.approx(1.0, rel=1e-5)


@LAW
@given(st.floats(0.1, 2.0), st.floats(0.1, 50.0))
def test_a_second_order_response_has_the_norm_of_its_lobes(zeta, omega):
    norm = norms.of_rational((omega**2,), (1.0, 2.0 * zeta * omega, omega**2))
    assert norm == pytest.approx(second_order_norm(zeta), rel=1e-4)


def test_what_goes_straight_through_counts():
    # s ω/(s + ω) = ω - ω²/(s + ω): ω and ω.
    assert norms.of_rational((3.0, 0.0), (1.0, 3.0)) == pytest.approx(6.0, rel=1e-5)
    assert norms.of_rational((-2.0,), (4.0,)) == 0.5


@pytest.mark.parametrize(
    ("numerator", "denominator"), [((1.0,), (1.0, -1.0)), ((1.0, 0.0, 0.0), (1.0, 1.0))]
)
def test_an_unstable_or_improper_function_has_none(numerator, denominator):
    with pytest.raises(ValueError, match="proper, stable"):
        norms.of_rational(numerator, denominator)
    with pytest.raises(ValueError, match="unstable"):
        norms.from_frequency_response(lambda s: 1.0 / (s - 1.0), -1.0)


@pytest.mark.parametrize("zeta", [0.2, 0.7, 1.5])
def test_the_frequency_response_gives_the_same_norm_as_the_state_space(zeta):
    omega = 3.0
    slowest = omega * (zeta - np.sqrt(max(0.0, zeta**2 - 1.0)))
    norm = norms.from_frequency_response(
        lambda s: omega**2 / (s**2 + 2.0 * zeta * omega * s + omega**2), slowest
    )
    assert norm.value == pytest.approx(second_order_norm(zeta), rel=1e-5)
    assert norm.uncertainty < 1e-4


@pytest.mark.parametrize(
    ("attitude_rad_s", "delay_s", "of_g"),
    [(None, 0.0, 3.28), (12.0, 0.0, 4.40), (12.0, 0.03, 4.80)],
)
def test_norms_of_a_plant_that_was_reckoned_before_by_other_means(attitude_rad_s, delay_s, of_g):
    """m 0.9, ω 0.40, drag 0.15 v + 0.02 v|v| linearised at 2.5 m/s; Padé for the delay there."""
    plant = horizontal(attitude_rad_s, 0.8, 0.25, delay_s)
    loop = loop_of(plant, m=0.9, omega=0.4)
    decay = -poles_of_h(loop)[0].real
    assert norms.from_frequency_response(loop.g, decay).value == pytest.approx(of_g, rel=0.01)
    if delay_s:
        norm = norms.from_frequency_response(loop.ch_over_m, decay)
        assert norm.value == pytest.approx(1.82, rel=0.01)


@LAW
@given(st.floats(0.5, 1.5), st.floats(0.15, 0.4), st.floats(0.0, 0.05))
def test_no_input_of_size_1_gives_more_than_the_norm(m, omega, delay_s):
    loop = loop_of(horizontal(delay_s=delay_s), m=m, omega=omega)
    decay = -poles_of_h(loop)[0].real
    norm = norms.from_frequency_response(loop.g, decay)
    step_s = norm.times_s[1]
    rng = np.random.default_rng(1)
    d = np.repeat(rng.choice([-1.0, 1.0], 40), 500)  # changes sign every half second
    response = norm.response[: len(d)]
    length = 2 * len(d)
    y = np.fft.irfft(np.fft.rfft(d, length) * np.fft.rfft(response, length), length) * step_s
    assert np.abs(y[: len(d)]).max() <= norm.value + norm.uncertainty
    # The worst input is the sign of the reversed impulse response: the norm is reached.
    worst = float(np.sign(response) @ response) * step_s
    assert worst == pytest.approx(norm.value, rel=0.02)
