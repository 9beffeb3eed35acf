"""What is learnt of the attitude's lag, and from what nothing is."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control.plus import lag
from companion.control.plus.lag import LagSettings
from tests.companion.control.plus.examples import vectors

LAW = LagSettings()
IDENTIFIED_S = 0.135


def flown(extra_s, *, offset=(0.0, 0.0), amplitude=1.5, noise=0.0, seconds=20.0, memory=None):
    """The memory after a flight along a smooth path whose tilt comes late by so much."""
    rng = np.random.default_rng(1)
    memory = memory or lag.start()
    turns = np.array([1.7, 2.3])

    def tilt(t):
        return amplitude * np.sin(turns * t), amplitude * turns * np.cos(turns * t)

    for k in range(round(seconds / 0.01)):
        t = 0.01 * k
        modelled, rate = tilt(t)
        measured = tilt(t - extra_s)[0] + offset + noise * rng.standard_normal(2)
        memory = lag.step(LAW, memory, measured, modelled, rate, 0.01)
    return memory


@settings(deadline=None, derandomize=True, max_examples=10)
@given(st.floats(-0.05, 0.12))
def test_an_attitude_that_lags_more_or_less_is_found_out(extra_s):
    found = lag.extra_lag_s(LAW, flown(extra_s))
    assert found == pytest.approx(extra_s, rel=0.1, abs=1e-3)


@settings(deadline=None, derandomize=True, max_examples=5)
@given(vectors(1.0, 2))
def test_a_trim_that_is_off_teaches_no_lag(offset):
    assert abs(lag.extra_lag_s(LAW, flown(0.0, offset=offset))) < 3e-3


def test_at_rest_nothing_is_learnt():
    """Neither from noise of the measured tilt, nor from a command that trembles."""
    still = flown(0.0, amplitude=0.0, noise=0.05)
    assert lag.extra_lag_s(LAW, still) == 0.0
    trembling = flown(0.0, amplitude=0.02, noise=0.05)
    assert abs(lag.extra_lag_s(LAW, trembling)) < 0.005


def test_at_rest_it_is_forgotten_again():
    after = flown(0.06, seconds=20.0)
    much = lag.extra_lag_s(LAW, after)
    assert much > 0.05
    later = flown(0.0, amplitude=0.0, seconds=60.0, memory=after)
    assert abs(lag.extra_lag_s(LAW, later)) < 0.1 * much


@settings(deadline=None, derandomize=True, max_examples=8)
@given(st.floats(-0.3, 0.6))
def test_it_goes_no_farther_than_its_limits(extra_s):
    scale = lag.scale(LAW, flown(extra_s, seconds=6.0), IDENTIFIED_S)
    assert LAW.least_scale <= scale <= LAW.greatest_scale


def test_both_limits_can_be_reached():
    assert lag.scale(LAW, flown(-0.2), IDENTIFIED_S) == LAW.least_scale
    assert lag.scale(LAW, flown(0.4), IDENTIFIED_S) == LAW.greatest_scale


def test_the_scale_makes_up_the_lag_that_was_learnt():
    memory = flown(0.05)
    scale = lag.scale(LAW, memory, IDENTIFIED_S)
    assert (scale - 1.0) * IDENTIFIED_S == pytest.approx(lag.extra_lag_s(LAW, memory))
    assert lag.scale(LAW, lag.start(), IDENTIFIED_S) == 1.0


def test_it_is_learnt_within_a_few_seconds():
    assert lag.extra_lag_s(LAW, flown(0.06, seconds=4.0)) > 0.6 * 0.06
    assert math.isfinite(lag.extra_lag_s(LAW, lag.start()))
