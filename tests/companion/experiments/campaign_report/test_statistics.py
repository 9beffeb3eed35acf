"""Shares and quantiles."""

import math

import numpy as np
import pytest

from companion.experiments.campaign_report.statistics import distribution, proportion


def test_wilsons_interval_is_the_published_one():
    found = proportion(81, 263)  # R. G. Newcombe (1998), table I: method 3
    assert (found.low, found.high) == pytest.approx((0.2553, 0.3662), abs=5e-5)


def test_none_of_few_flights_still_leaves_a_share_open():
    found = proportion(0, 20)
    assert (found.share, found.low) == (0.0, 0.0)
    assert found.high == pytest.approx(0.1611, abs=1e-4)
    assert proportion(20, 20).low == pytest.approx(1.0 - found.high)
    assert math.isnan(proportion(0, 0).share)


def test_a_lost_flight_is_the_worst_and_not_part_of_the_mean():
    found = distribution(np.array([0.01, 0.02, 0.03, 0.04, math.inf]))
    assert found.mean == pytest.approx(0.025)
    assert (found.median, found.worst_tracked) == (0.03, 0.04)
    assert found.p90 == found.p99 == found.worst == math.inf


def test_of_no_flight_nothing_is_known():
    assert math.isnan(distribution(np.array([])).median)
