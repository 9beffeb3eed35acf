"""Somebody sets parameters that the flight goes by, while it goes on."""

import asyncio

import pytest

from companion.flight.inbox import PilotCommand
from companion.mavlink.messages import MessageId, Outgoing, Target
from companion.mavlink.parameters import ParameterType, set_request
from tests.flights.test_flights_ardupilot import BRAKE, modes_asked
from tests.flights.test_flights_before_arming import NOT_READY
from tests.flights.test_flights_refusals import assert_refused

WAIT = {"timeouts.handed_over_s": "3.0"}
OPTIONS = b"GUID_OPTIONS"
PARAM_REQUEST_LIST = 21


@pytest.fixture
def ardupilot(bench):
    bench.flies = "ardupilot"
    return bench


def set_parameter(bench, name, value, kind=ParameterType.REAL32):
    """As a ground station on the same link."""
    encoding = bench.wire.dialect.parameter_encoding
    bench.wire.send_to_vehicle(set_request(name, value, kind, encoding, Target(1)))


def thrust_as_thrust(bench):
    set_parameter(bench, "GUID_OPTIONS", 8.0)


def assert_flown_by_throttle(flown, since_s=0.0):
    """A hover thrust is estimated only for a throttle."""
    tracked = [
        r.values["hover_thrust"]
        for r in flown.records("control")
        if r.values["phase"] == "track" and r.time_s > since_s
    ]
    assert len(tracked) > 300
    assert None not in tracked


def lose_answers(bench, name):
    bench.wire.from_shim = lambda p: (
        b"" if p.message_id == MessageId.PARAM_VALUE and name in p.payload else p.raw
    )


def test_what_is_set_while_the_companion_waits_is_flown(ardupilot):
    bench = ardupilot
    bench.wire.from_shim = NOT_READY
    bench.after("ready", 3.0, lambda: thrust_as_thrust(bench))
    bench.after("ready", 5.0, bench.wire.restore)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    assert len(flown.told("somebody set GUID_OPTIONS from 0 to 8; flown accordingly")) == 1
    assert_flown_by_throttle(flown)


def test_a_thrust_field_whose_meaning_is_lost_before_arming_refuses_the_flight(ardupilot):
    bench = ardupilot
    bench.wire.from_shim = NOT_READY
    bench.after("ready", 5.0, lambda: lose_answers(bench, OPTIONS))
    assert_refused(bench.fly(), "did not answer what GUID_OPTIONS is")


def test_what_is_set_during_the_take_off_is_flown(ardupilot):
    bench = ardupilot
    bench.after("take off", 2.0, lambda: thrust_as_thrust(bench))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    assert_flown_by_throttle(flown)


def test_a_meaning_that_is_lost_during_the_take_off_lands(ardupilot):
    bench = ardupilot
    bench.after("take off", 2.0, lambda: lose_answers(bench, OPTIONS))
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    assert "did not answer what GUID_OPTIONS is" in flown.outcome.note
    assert flown.wire.setpoints == []
    assert flown.wire.armed[-1][1] is False


@pytest.mark.parametrize(
    ("phase", "name", "value", "said"),
    [
        ("approach", "GUID_OPTIONS", 8.0, "GUID_OPTIONS from 0 to 8"),
        ("track", "GUID_OPTIONS", 8.0, "GUID_OPTIONS from 0 to 8"),
        ("track", "WPNAV_SPEED_UP", 500.0, "WPNAV_SPEED_UP from 250 to 500"),
    ],
)
def test_setpoints_of_a_meaning_that_is_not_true_any_more_end_at_once(
    ardupilot, phase, name, value, said
):
    """None of them holds the vehicle while BRAKE is commanded, either."""
    bench = ardupilot
    bench.after(phase, 1.0, lambda: set_parameter(bench, name, value))
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    (told,) = flown.told(f"handing over: somebody set {said} in flight; ArduPilot is commanded")
    assert told - flown.began(phase) - 1.0 < 0.1
    assert flown.wire.setpoints_after(told) == []
    assert modes_asked(flown, told)[0] == BRAKE
    assert flown.wire.modes[-1][1] == "brake"
    braked = next(t for t, mode in flown.wire.modes if mode == "brake")
    assert braked - told < 1.0


def test_a_change_while_the_vehicle_is_held_for_the_hand_over_ends_that(ardupilot):
    """BRAKE is not confirmed yet, and level setpoints would have the old meaning."""
    bench = ardupilot

    def begin():
        bench.wire.from_shim = lambda p: (
            b"" if p.message_id in (MessageId.HEARTBEAT, MessageId.CURRENT_MODE) else p.raw
        )
        bench.wire.restore_after(0.8)
        bench.inbox.put(PilotCommand.ABORT)
        asyncio.get_running_loop().call_later(0.3, thrust_as_thrust, bench)

    bench.after("track", 1.0, begin)
    flown = bench.fly(settings=WAIT)
    begun = flown.began("track") + 1.0
    held = flown.wire.setpoints_after(begun)
    assert 0.25 < held[-1].time_s - begun < 0.4


def test_after_a_takeover_it_is_resumed_with_what_is_true_then(ardupilot):
    bench = ardupilot
    bench.after("track", 1.0, lambda: bench.wire.change_mode("loiter"))
    bench.after("handed over", 1.0, lambda: thrust_as_thrust(bench))
    bench.after("handed over", 2.0, lambda: bench.inbox.put(PilotCommand.RESUME))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    assert_flown_by_throttle(flown, flown.began("handed over"))
    assert flown.outcome.fallbacks == 0


def test_a_change_that_nobody_told_is_read_at_the_resumption(ardupilot):
    bench = ardupilot

    def change_unheard():
        lose_answers(bench, OPTIONS)
        bench.wire.restore_after(0.5)
        thrust_as_thrust(bench)

    bench.after("track", 1.0, lambda: bench.wire.change_mode("loiter"))
    bench.after("handed over", 1.0, change_unheard)
    bench.after("handed over", 2.0, lambda: bench.inbox.put(PilotCommand.RESUME))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert_flown_by_throttle(flown, flown.began("handed over"))


def test_what_cannot_be_flown_is_not_resumed(ardupilot):
    """Whoever has taken over goes on flying: nothing is commanded, no landing either."""
    bench = ardupilot
    bench.after("track", 1.0, lambda: bench.wire.change_mode("loiter"))
    bench.after("handed over", 1.0, lambda: lose_answers(bench, OPTIONS))
    bench.after("handed over", 2.0, lambda: bench.inbox.put(PilotCommand.RESUME))
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    assert len(flown.told("handed over: not resumed: ArduPilot did not answer")) == 1
    handed = flown.began("handed over")
    assert modes_asked(flown, handed) == []
    assert flown.wire.setpoints_after(handed) == []


def test_a_ground_station_that_only_reads_changes_nothing(ardupilot):
    bench = ardupilot
    request = Outgoing(PARAM_REQUEST_LIST, bytes([1, 1]))
    bench.after("track", 1.0, lambda: bench.wire.send_to_vehicle(request))
    bench.after("track", 2.0, lambda: set_parameter(bench, "GUID_OPTIONS", 0.0))
    bench.after("track", 2.1, lambda: set_parameter(bench, "WPNAV_SPEED", 700.0))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed


@pytest.mark.parametrize(("timeout_s", "outcome"), [(0.4, "aborted"), (1.0, "landed")])
def test_the_longest_pause_follows_px4s_time_out_in_flight(bench, timeout_s, outcome):
    bench.after("approach", 0.5, lambda: set_parameter(bench, "COM_OF_LOSS_T", timeout_s))
    bench.after("track", 1.0, lambda: asyncio.get_running_loop().stall(0.3))
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == outcome
    stood_still = flown.told("handing over: the companion itself stood still for 0.3 s")
    assert bool(stood_still) == (outcome == "aborted")


def test_px4s_height_of_the_take_off_is_the_one_at_arming(bench):
    bench.wire.from_shim = NOT_READY
    bench.after("ready", 2.0, lambda: set_parameter(bench, "MIS_TAKEOFF_ALT", 1.8))
    bench.after("ready", 4.0, bench.wire.restore)
    flown = bench.fly(settings={"takeoff_height_m": "2.5"})
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert len(flown.told("PX4 takes off to its own height of 1.8 m")) == 1
