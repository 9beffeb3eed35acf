"""What is learnt of drag, tilt gain and heading, and what does not mislead."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.plus import mismatch
from companion.control.plus.mismatch import NOTHING, Mismatch, MismatchSettings
from tests.companion.control.plus.examples import vectors

LAW = MismatchSettings()
DENSITY = 0.05
DT = 0.01
true_ones = st.builds(Mismatch, st.floats(-0.1, 0.4), st.floats(-0.2, 0.2), st.floats(-0.3, 0.3))


def flown(truth, *, wind=lambda t: np.zeros(2), seconds=25.0, amplitude=1.5, known=NOTHING):
    """What is learnt along a smooth path, where velocities are off by 1.5 cm/s at each sample."""
    rng = np.random.default_rng(2)
    memory, found = mismatch.start(), known
    turns = np.array([1.7, 2.6])
    off = np.zeros(2)
    for k in range(round(seconds / DT)):
        t = k * DT
        v = amplitude * np.sin(turns * t) / turns
        # By the tilt that was measured: what it does in truth is more, and turned.
        pushed = truth.asks(amplitude * np.cos(turns * t) + truth.drag_1_s * v)
        sigma = wind(t)
        left = truth.pushes(pushed) - pushed - truth.drag_1_s * v + sigma
        off, before = 0.015 * rng.standard_normal(2), off
        left, v = left + (off - before) / DT, v + 0.5 * (off + before)
        memory = mismatch.step(LAW, memory, left, v, pushed, sigma, DT)
        found = mismatch.learnt(LAW, memory, found, DENSITY, DT)
    return found


@settings(deadline=None, derandomize=True)
@given(true_ones, vectors(5.0, 2))
def test_asking_is_the_inverse_of_pushing(wrong, acceleration):
    assert wrong.asks(wrong.pushes(acceleration)) == pytest.approx(acceleration)
    assert wrong.pushes(wrong.asks(acceleration)) == pytest.approx(acceleration)


@settings(deadline=None, derandomize=True)
@given(true_ones, vectors(5.0, 4))
def test_an_acceleration_and_its_rate_are_pushed_alike(wrong, numbers):
    both = numbers.reshape(2, 2)
    pushed = wrong.pushes(both)
    assert pushed[:, 0] == pytest.approx(wrong.pushes(both[:, 0]))
    assert pushed[:, 1] == pytest.approx(wrong.pushes(both[:, 1]))


def test_a_heading_that_is_off_turns_what_is_pushed():
    turned = Mismatch(0.0, 0.0, 0.1).pushes(np.array([1.0, 0.0]))
    assert turned == pytest.approx([1.0, 0.1])
    assert Mismatch(0.0, 0.2, 0.0).pushes(np.array([1.0, -2.0])) == pytest.approx([1.2, -2.4])


@settings(deadline=None, derandomize=True, max_examples=6)
@given(true_ones)
def test_drag_gain_and_heading_are_found_together(truth):
    found = flown(truth)
    assert found.drag_1_s == pytest.approx(truth.drag_1_s, abs=0.04)
    assert found.gain == pytest.approx(truth.gain, abs=0.02)
    assert found.heading_rad == pytest.approx(truth.heading_rad, abs=0.02)


@settings(deadline=None, derandomize=True, max_examples=3)
@given(vectors(3.0, 2))
def test_a_steady_wind_teaches_nothing_wrong(push):
    found = flown(NOTHING, wind=lambda t: push)
    assert abs(found.drag_1_s) < 0.04
    assert abs(found.gain) < 0.02
    assert abs(found.heading_rad) < 0.02


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_gusts_teach_little_that_is_wrong(seed):
    """Of 0.6 m/s², alike over 2 s: where nothing is certain, little is believed."""
    rng = np.random.default_rng(seed)
    gusts, now = [], np.zeros(2)
    for _ in range(2500):
        now = now * math.exp(-DT / 2.0)
        now = now + 0.6 * math.sqrt(1.0 - math.exp(-2.0 * DT / 2.0)) * rng.standard_normal(2)
        gusts.append(now)
    found = flown(NOTHING, wind=lambda t: gusts[round(t / DT)])
    assert abs(found.drag_1_s) < LAW.drag_1_s
    assert abs(found.gain) < LAW.gain
    assert abs(found.heading_rad) < LAW.heading_rad


def test_at_rest_nothing_is_learnt():
    found = flown(NOTHING, amplitude=0.0)
    assert abs(found.drag_1_s) < 1e-3
    assert (found.gain, found.heading_rad) == (0.0, 0.0)


def test_at_rest_what_was_learnt_is_forgotten():
    before = Mismatch(0.3, 0.1, 0.1)
    found = flown(NOTHING, amplitude=0.0, seconds=5.0, known=before)
    assert abs(found.drag_1_s) < 0.01  # noise of the velocity stands beside what is forgotten
    assert abs(found.gain) < 1e-3
    assert abs(found.heading_rad) < 1e-3


@settings(deadline=None, derandomize=True, max_examples=4)
@given(st.sampled_from([-1.0, 1.0]), st.sampled_from([-1.0, 1.0]))
def test_it_goes_no_farther_than_its_limits(one, other):
    found = flown(Mismatch(1.5 * one, 0.6 * other, 0.8 * one), seconds=10.0)
    assert abs(found.drag_1_s) <= LAW.farthest * LAW.drag_1_s
    assert abs(found.gain) <= LAW.farthest * LAW.gain
    assert abs(found.heading_rad) <= LAW.farthest * LAW.heading_rad


def test_what_is_learnt_moves_slowly_into_the_command():
    memory = mismatch.start()
    ones = np.array([1.0, -1.0])
    for k in range(100):
        signs = ones if k % 2 else -ones
        memory = mismatch.step(LAW, memory, -0.3 * signs, signs, 0.0 * ones, 0.0 * ones, DT)
    first = mismatch.learnt(LAW, memory, NOTHING, DENSITY, DT)
    later = first
    for _ in range(500):
        later = mismatch.learnt(LAW, memory, later, DENSITY, DT)
    assert 0.0 < first.drag_1_s < 0.05 * later.drag_1_s
