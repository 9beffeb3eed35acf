"""Commands in order; punctuality as it is defined."""

import pytest

from companion.flight.inbox import Inbox, PilotCommand
from companion.flight.setpoints.timing import DEADLINE_S, Punctuality, percentiles_ms


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
    assert percentiles_ms([]) is None
    figures = percentiles_ms([k * 1e-3 for k in range(101)])
    assert (figures.p50, figures.p99, figures.max) == pytest.approx((50.0, 99.0, 100.0))
