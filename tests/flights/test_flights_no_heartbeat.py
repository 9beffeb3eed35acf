"""Heartbeats stop, by whoever's request, and everything else of the vehicle goes on."""

import pytest

from companion.mavlink.messages import MessageId
from tests.flights.test_flights_refusals import assert_refused

WAIT = {"timeouts.handed_over_s": "3.0"}
WITHIN_S = 5.0
"""Up to a second since the last one, and the patience."""


def stop_heartbeats(bench):
    bench.wire.cut(None, (MessageId.HEARTBEAT,))


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_in_flight_that_ends_it(bench, autopilot):
    bench.flies = autopilot
    bench.after("approach", 0.0, lambda: stop_heartbeats(bench))

    flown = bench.fly(settings=WAIT)

    assert flown.outcome.outcome == "aborted"
    assert "no HEARTBEAT" in flown.outcome.note
    (told,) = flown.told("handed over: no HEARTBEAT")
    assert 2.0 < told - flown.began("approach") < WITHIN_S
    assert flown.wire.setpoints_after(told + 1.2) == []
    if autopilot == "ardupilot":
        assert "brake" in [mode for _, mode in flown.wire.modes]


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_while_it_lands_nobody_waits_for_the_end_of_a_landing_that_is_not_reported(
    bench, autopilot
):
    bench.flies = autopilot
    bench.after("land", 0.5, lambda: stop_heartbeats(bench))

    flown = bench.fly(settings=WAIT)

    (told,) = flown.told("handed over: no HEARTBEAT")
    assert told - flown.began("land") < WITHIN_S
    assert flown.outcome.outcome == "aborted"


@pytest.mark.parametrize("phase", ["connect", "ready"])
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_before_arming_that_refuses_it(bench, autopilot, phase):
    bench.flies = autopilot
    delay_s = 1.5 if phase == "connect" else 0.0
    bench.after(phase, delay_s, lambda: stop_heartbeats(bench))

    flown = bench.fly(settings=WAIT, boot_scale=0.3)

    assert_refused(flown, "no HEARTBEAT")
    assert not flown.was_armed


@pytest.mark.parametrize("speed", [1.0, 5.0])
def test_a_link_that_was_silent_is_given_time_for_its_next_heartbeat(bench, speed):
    bench.after("track", 0.5, lambda: bench.wire.cut(0.8 / speed))

    flown = bench.fly(speed=speed)

    assert flown.told("no HEARTBEAT") == []
    assert flown.outcome.outcome == "landed", flown.outcome.note
