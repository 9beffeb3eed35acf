"""Heartbeats that stop while other messages go on."""

import pytest

from companion.flight.vehicle.losses import Losses
from companion.flight.vehicle.pulse import MISSING_S, Pulse


def heard(pulse, begin_s, end_s, *, beats=False):
    """Messages ten times a second, heartbeats once."""
    for tick in range(round(begin_s * 10), round(end_s * 10)):
        pulse.on_message(tick / 10)
        if beats and tick % 10 == 0:
            pulse.on_heartbeat(tick / 10)


@pytest.fixture
def pulse():
    made = Pulse(lambda seconds: seconds, Losses())
    heard(made, 0.0, 5.1, beats=True)
    return made


def test_heartbeats_that_come_are_not_missing(pulse):
    assert not pulse.missing(5.1)


def test_they_are_missing_once_three_have_not_come_though_others_do(pulse):
    heard(pulse, 5.1, 8.4)
    assert not pulse.missing(8.4)
    heard(pulse, 8.4, 8.7)
    assert pulse.missing(8.6)


def test_two_lost_ones_are_nothing(pulse):
    heard(pulse, 5.1, 8.0)
    pulse.on_heartbeat(8.05)
    heard(pulse, 8.1, 11.0)
    assert not pulse.missing(11.0)


def test_a_silent_link_is_another_matter(pulse):
    assert not pulse.missing(30.0)


def test_after_a_silence_they_are_missed_anew(pulse):
    heard(pulse, 20.0, 23.0)
    assert not pulse.missing(23.0)
    heard(pulse, 23.0, 24.0)
    assert pulse.missing(23.9)


def test_a_restart_begins_anew(pulse):
    heard(pulse, 5.1, 8.0)
    pulse.forget()
    heard(pulse, 8.0, 11.0)
    assert not pulse.missing(11.0)


def test_time_is_the_autopilots():
    fast = Pulse(lambda seconds: seconds / 10.0, Losses())
    fast.on_heartbeat(0.0)
    for tick in range(40):
        fast.on_message(tick / 100)
    assert fast.missing(0.1 * MISSING_S + 0.01)
    assert not fast.missing(0.1 * MISSING_S - 0.01)


def test_on_a_link_that_loses_packets_more_of_them_are_awaited():
    losses = Losses()
    for number in range(0, 6000, 2):  # every other one
        losses.on_packet(number % 256)
    pulse = Pulse(lambda seconds: seconds, losses)
    heard(pulse, 0.0, 5.1, beats=True)
    heard(pulse, 5.1, 12.0)
    assert not pulse.missing(12.0)
    heard(pulse, 12.0, 5.1 + pulse.missing_after_s + 1.0)
    assert pulse.missing(5.1 + pulse.missing_after_s)
