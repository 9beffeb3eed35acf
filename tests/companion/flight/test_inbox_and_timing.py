"""Commands in order; punctuality as it is defined."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.flight.inbox import Inbox, PilotCommand
from companion.flight.setpoints.timing import DEADLINE_S, Punctuality, Times, percentiles_ms


def test_commands_are_taken_in_the_order_in_which_they_came():
    inbox = Inbox()
    told = []
    inbox.put(PilotCommand.LAND)
    inbox.on_put = told.append
    inbox.put(PilotCommand.ABORT)
    assert inbox.waiting
    assert [inbox.take(), inbox.take(), inbox.take()] == [
        PilotCommand.LAND,
        PilotCommand.ABORT,
        None,
    ]
    assert not inbox.waiting
    assert told == [PilotCommand.ABORT]


def test_a_setpoint_in_time_misses_nothing():
    punctuality = Punctuality(period_s=0.01)
    for k in range(100):
        punctuality.tick(0.01 * k, 0.01 * k + 0.001)
    assert (punctuality.ticks, punctuality.missed_deadlines) == (100, 0)


def test_a_setpoint_too_long_after_its_sample_is_a_missed_deadline():
    punctuality = Punctuality(period_s=0.01)
    punctuality.tick(0.0, DEADLINE_S * 0.99)
    punctuality.tick(0.01, 0.01 + DEADLINE_S * 1.01)
    assert punctuality.missed_deadlines == 1


def test_no_tick_within_two_periods_is_a_missed_deadline():
    punctuality = Punctuality(period_s=0.01)
    punctuality.tick(0.0, 0.0)
    punctuality.tick(0.024, 0.024)
    assert punctuality.missed_deadlines == 0
    punctuality.tick(0.050, 0.050)
    assert punctuality.missed_deadlines == 1


def test_a_planned_pause_is_none():
    punctuality = Punctuality(period_s=0.01)
    punctuality.tick(0.0, 0.0)
    punctuality.pause()
    punctuality.tick(9.0, 9.0)
    assert punctuality.missed_deadlines == 0


def test_percentiles():
    assert percentiles_ms(Times()) is None
    figures = percentiles_ms(Times(k * 1e-3 for k in range(101)))
    assert (figures.p50, figures.p99, figures.max) == pytest.approx((50.0, 99.0, 100.0))


def test_there_is_no_percentile_of_no_times():
    with pytest.raises(ValueError, match="no times"):
        Times().percentile_s(50.0)


@settings(deadline=None, derandomize=True)
@given(
    st.lists(st.floats(1e-6, 900.0), min_size=1, max_size=300),
    st.sampled_from([0.0, 1.0, 50.0, 90.0, 99.0, 100.0]),
)
def test_percentiles_are_those_of_all_times_to_within_1_percent(times_s, percent):
    told = Times(times_s).percentile_s(percent)
    assert told == pytest.approx(np.percentile(times_s, percent), rel=0.01)


@settings(deadline=None, derandomize=True)
@given(st.lists(st.floats(-1.0, 1e6), min_size=1, max_size=50))
def test_the_greatest_time_is_exact_whatever_it_is(times_s):
    assert Times(times_s).percentile_s(100.0) == max(times_s)


def test_percentiles_of_a_loop_as_it_is_are_accurate():
    times_s = np.random.default_rng(7).lognormal(np.log(8e-4), 0.4, 50_000)
    told = Times(times_s.tolist())
    for percent in (50.0, 99.0):
        assert told.percentile_s(percent) == pytest.approx(
            np.percentile(times_s, percent), rel=6e-3
        )


def test_punctuality_takes_no_more_memory_for_more_ticks():
    punctuality = Punctuality(period_s=0.01)

    def fly(ticks):
        for k in range(ticks):
            punctuality.tick(0.01 * k, 0.01 * k + 1e-6 * (k % 5000))

    fly(1000)
    tracemalloc.start()
    try:
        fly(20_000)
        grown_bytes = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert grown_bytes < 2000
