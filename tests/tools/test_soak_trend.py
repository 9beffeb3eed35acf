"""The line through a gauge, and how sure its slope is said to be."""

import numpy as np
import pytest

from tools.soak.trend import trend_of


def test_a_line_is_found_exactly_and_for_certain():
    times_h = np.linspace(0.0, 2.0, 61)
    trend = trend_of(times_h, 5.0 + 0.3 * times_h, block=5)
    assert trend.blocks == 12
    assert (trend.slope_per_h, trend.upper_per_h) == pytest.approx((0.3, 0.3))
    assert trend.at(1.5) == pytest.approx(5.45)


def test_what_does_not_change_has_a_slope_and_a_limit_of_nothing():
    trend = trend_of(np.linspace(0.0, 0.1, 40), [17.0] * 40, block=3)
    assert (trend.slope_per_h, trend.lower_per_h, trend.upper_per_h) == (0.0, 0.0, 0.0)


def test_what_is_left_over_is_left_out_at_the_beginning():
    values = [1000.0] + [1.0, 2.0] * 6
    assert trend_of(range(13), values, block=2).middle == 1.5


def test_too_few_blocks_give_no_verdict():
    with pytest.raises(ValueError, match="3 blocks; 4 are needed"):
        trend_of(range(11), [0.0] * 11, block=3)


def test_the_limits_hold_as_often_as_they_say_for_a_level_that_stays_for_a_while():
    """Samples alike over ten, as an allocator's: single ones would be far too sure of the slope."""
    rng = np.random.default_rng(5)
    times_h = np.linspace(0.0, 1.0, 600)
    above = {1: 0, 50: 0}
    for _ in range(400):
        shocks, level, values = rng.standard_normal(600), 0.0, []
        for shock in shocks:
            level = 0.9 * level + shock
            values.append(level)
        for block in above:
            above[block] += trend_of(times_h, values, block).upper_per_h >= 0.0
    assert above[50] / 400 > 0.92
    assert above[1] / 400 < 0.8
