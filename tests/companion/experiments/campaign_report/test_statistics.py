"""Shares and quantiles."""

import math

import numpy as np
import pytest

from companion.experiments.campaign_report.statistics import (
    clustered,
    distribution,
    proportion,
)


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


def test_the_interval_of_flights_that_share_conditions_holds_the_true_share():
    """Fifty conditions with a chance of loss each (0.3 on average), flown ten times."""
    together, held, taken = np.repeat(np.arange(50), 10), 0, 0
    for k in range(200):
        drawn = np.random.default_rng(k)
        lost = drawn.random(500) < drawn.beta(0.6, 1.4, 50)[together]
        found, naive = clustered(lost, together), proportion(int(lost.sum()), 500)
        held += found.low <= 0.3 <= found.high
        taken += naive.low <= 0.3 <= naive.high
    assert held >= 180
    assert taken <= 150


def test_flights_of_their_own_conditions_have_wilsons_interval_and_all_alike_count_once():
    lost = np.arange(60) % 4 == 0
    assert clustered(lost, np.arange(60)) == proportion(15, 60)
    same = clustered(np.repeat(lost, 3), np.repeat(np.arange(60), 3))
    assert (same.low, same.high) == pytest.approx((0.157, 0.373), abs=0.002)
    assert clustered(np.zeros(40, dtype=bool), np.repeat(np.arange(20), 2)).high == (
        proportion(0, 20).high
    )


def test_the_rest_of_a_share_has_the_mirrored_interval():
    assert proportion(3, 20).rest.count == 17
    assert proportion(3, 20).rest.low == pytest.approx(proportion(17, 20).low)
