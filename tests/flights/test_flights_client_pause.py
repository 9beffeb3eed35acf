"""A client of the shared link wants a pause where the autopilot would deny it."""

import contextlib

import pytest

from companion.flight.shared_link.sharing import hand_over_for_a_pause

WAIT = {"timeouts.handed_over_s": "3.0"}


@pytest.fixture
def flights(monkeypatch):
    """The flight that runs, for as long as it runs."""
    running = []

    @contextlib.asynccontextmanager
    async def catch(flight):
        running.append(flight)
        yield

    monkeypatch.setattr("companion.flight.conduct.shared_link", catch)
    return running


@pytest.mark.parametrize("phase", ["take off", "track", "return"])
def test_on_ardupilot_the_companion_brakes_for_it(bench, flights, phase):
    bench.flies = "ardupilot"
    heeded = []
    bench.after(phase, 1.0, lambda: heeded.append(hand_over_for_a_pause(flights[0])))

    flown = bench.fly(settings=WAIT)

    assert heeded == [True]
    assert flown.outcome.outcome == "aborted"
    assert flown.wire.modes[-1][1] == "brake"
    asked_s = flown.began(phase) + 1.0
    braked_s = next(t for t, mode in flown.wire.modes if mode == "brake")
    assert braked_s - asked_s < 1.5
    assert flown.wire.setpoints_after(braked_s + 0.3) == []
    assert len(flown.told("a ground station asked for a pause: handing over")) == 1


def test_there_is_nothing_to_end_while_it_lands(bench, flights):
    bench.flies = "ardupilot"
    heeded = []
    bench.after("land", 1.0, lambda: heeded.append(hand_over_for_a_pause(flights[0])))

    flown = bench.fly()

    assert heeded == [False]
    assert flown.outcome.outcome == "landed", flown.outcome.note
