from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.feedback import direct
from companion.control.inner import L1Controller
from companion.control.l1_adaptive import first_order_gains
from companion.theory.loops import whole_loop_is_stable
from companion.theory.margins import continuous_margins, sampled_margins
from companion.theory.nyquist import unstable_zeros
from companion.theory.plant import AxisPlant
from companion.theory.sampled_data import period_map, sampled_loop
from tests.companion.theory.loops_for_tests import horizontal, loop_of

LAW = settings(deadline=None, derandomize=True, max_examples=15)
FEW = settings(LAW, max_examples=4)
INSIDE, OUTSIDE = 0.98, 1.02


def test_the_margins_of_a_textbook_loop():
    margins = continuous_margins(lambda s: 1.0 / (s * (s + 1.0) * (s + 2.0)))
    assert margins.gain_up == pytest.approx(6.0, rel=1e-4)
    assert margins.gain_down == 0.0
    omega = margins.crossover_rad_s
    assert omega * np.sqrt((1 + omega**2) * (4 + omega**2)) == pytest.approx(1.0, rel=1e-6)
    assert np.degrees(margins.phase_rad) == pytest.approx(53.41, abs=0.02)
    assert margins.delay_s == pytest.approx(margins.phase_rad / omega, rel=1e-9)


@LAW
@given(st.floats(0.4, 1.2), st.floats(0.1, 0.3), st.floats(0.0, 0.05), st.floats(300.0, 2000.0))
def test_the_loop_is_stable_within_its_margins_and_unstable_beyond(m, omega, delay_s, gamma):
    plant = horizontal(delay_s=delay_s)
    loop = loop_of(plant, m=m, omega=omega, gamma=gamma)
    if not whole_loop_is_stable(loop):
        return
    margins = continuous_margins(loop.broken_at_u)

    def stable(gain=1.0, more_s=0.0):
        other = AxisPlant(
            replace(plant.rational, numerator=tuple(gain * n for n in plant.rational.numerator)),
            delay_s + more_s,
        )
        return whole_loop_is_stable(replace(loop, plant=other))

    assert stable(gain=1.0 + INSIDE * (margins.gain_up - 1.0))
    assert not stable(gain=margins.gain_up * OUTSIDE)
    if margins.gain_down > 0.0:
        assert stable(gain=margins.gain_down * OUTSIDE)
        assert not stable(gain=margins.gain_down * INSIDE)
    assert stable(more_s=INSIDE * margins.delay_s)
    assert not stable(more_s=OUTSIDE * margins.delay_s)
    # The phase margin is a rotation of the whole curve.
    for share, expected in ((INSIDE, True), (OUTSIDE, False)):
        turn = np.exp(-1j * share * margins.phase_rad)
        moved = continuous_margins(lambda s, turn=turn: turn * loop.broken_at_u(s))
        assert (moved.phase_rad < np.radians(10.0)) == expected


def sampled(m, omega, gain_k, gamma, delay_s, sample_s=0.01):
    gains = first_order_gains((m,) * 2, (omega,) * 2, (gain_k,) * 2, (gamma,) * 2, (1e3,) * 2)
    plants = (horizontal(delay_s=delay_s), horizontal(15.0, 0.9, 0.3, delay_s))
    return sampled_loop(plants, L1Controller(gains), direct(2), sample_s, 0.0)


@FEW
@given(st.floats(0.45, 1.0), st.floats(0.1, 0.25), st.floats(0.0, 0.05), st.floats(400.0, 2000.0))
def test_so_is_the_sampled_loop(m, omega, delay_s, gamma):
    loop = sampled(m, omega, 0.7, gamma, delay_s)
    margins = sampled_margins(loop)
    for axis in range(2):
        if np.isnan(margins.gain_up[axis]):
            assert period_map(loop).radii[axis] >= 1.0
            continue

        def radius(axis=axis, **changed):
            return period_map(replace(loop, **changed)).radii[axis]

        up, down = margins.gain_up[axis], margins.gain_down[axis]
        late = margins.delay_s[axis]
        assert radius(gain=np.full(2, 1.0 + INSIDE * (up - 1.0))) < 1.0
        assert radius(gain=np.full(2, OUTSIDE * up)) >= 1.0
        if down > 0.0:
            assert radius(gain=np.full(2, OUTSIDE * down)) < 1.0
            assert radius(gain=np.full(2, INSIDE * down)) >= 1.0
        assert radius(more_delay_s=np.full(2, INSIDE * late)) < 1.0
        assert radius(more_delay_s=np.full(2, OUTSIDE * late)) >= 1.0


def test_sampled_fast_it_has_the_margins_of_continuous_time():
    margins = sampled_margins(sampled(0.5, 0.215, 0.75, 300.0, 0.04, sample_s=0.002))
    loop = loop_of(horizontal(delay_s=0.04))
    expected = continuous_margins(loop.broken_at_u)
    assert unstable_zeros(loop.return_difference) == 0
    assert margins.gain_up[0] == pytest.approx(expected.gain_up, rel=0.01)
    assert margins.gain_down[0] == pytest.approx(expected.gain_down, rel=0.01)
    # Half a sample of the hold is a part of the delay that it bears.
    assert margins.delay_s[0] == pytest.approx(expected.delay_s, abs=0.003)
