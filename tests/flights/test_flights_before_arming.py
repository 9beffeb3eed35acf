"""What somebody else does to the vehicle before the companion has armed it is not fought."""

import struct

import pytest

from companion.mavlink.commands import CommandId, arm, takeoff_here
from companion.mavlink.messages import MessageId, Target
from tests.flights.test_flights_refusals import assert_refused, edit
from tests.flights.wire import AUTOPILOT

PREARM = 0x1000_0000
SYS_STATUS = struct.Struct("<3I")
NOT_READY = edit(MessageId.SYS_STATUS, SYS_STATUS, lambda p, e, h: (p, e, h & ~PREARM))
"""The autopilot is, and says that it is not: the companion waits."""
GUIDED = 4.0


@pytest.fixture(params=["px4", "ardupilot"])
def bench(bench, request):
    bench.flies = request.param
    return bench


@pytest.fixture
def ardupilot(bench):
    if bench.flies != "ardupilot":
        pytest.skip("PX4 is armed in any mode")
    return bench


def somebody_arms(bench):
    bench.wire.send_to_vehicle(arm(Target(1)).as_long())


def assert_left_alone(flown, since_s):
    """Refused, and nothing was commanded of the vehicle that somebody else had armed."""
    assert flown.outcome.outcome == "refused"
    assert "The vehicle is armed already" in flown.outcome.note
    assert flown.was_armed
    assert flown.wire.setpoints == []
    steering = [CommandId.DO_SET_MODE, CommandId.NAV_TAKEOFF, CommandId.COMPONENT_ARM_DISARM]
    assert [c for t, c, _ in flown.wire.commands if c in steering and t > since_s] == []


@pytest.mark.parametrize("takes_off", [False, True])
def test_who_arms_the_vehicle_while_the_companion_waits_keeps_it(bench, takes_off):
    bench.wire.from_shim = NOT_READY
    bench.after("ready", 6.0, lambda: somebody_arms(bench))
    if takes_off and bench.flies == "px4":
        bench.after("ready", 6.1, lambda: bench.wire.send_to_vehicle(takeoff(bench)))
    flown = bench.fly()
    assert_left_alone(flown, flown.began("ready") + 6.0)
    # A HEARTBEAT tells, once a second.
    assert flown.records("event")[-1].time_s - flown.began("ready") < 7.2


def takeoff(bench):
    return takeoff_here(Target(1)).as_long()


class OnceReady:
    """Lets something happen when the autopilot says that it is ready, half a HEARTBEAT away."""

    def __init__(self, bench, action):
        self.bench, self.action = bench, action
        self.done_s = None
        self.heartbeat_s = 0.0

    def tamper(self, packet):
        bench = self.bench
        if packet.component_id != AUTOPILOT or self.done_s is not None:
            return packet.raw
        if packet.message_id == MessageId.HEARTBEAT:
            self.heartbeat_s = packet.time_s
        if packet.message_id != MessageId.SYS_STATUS:
            return packet.raw
        # ArduPilot says so in STABILIZE, too, where the companion does not arm.
        in_mode = bench.flies == "px4" or bench.wire.modes[-1][1] == "guided"
        soon = 0.4 < packet.time_s - self.heartbeat_s < 0.7
        if packet.fields(SYS_STATUS)[2] & PREARM and in_mode and soon and packet.time_s > 6.0:
            self.done_s = packet.time_s
            self.action()
            return packet.raw
        return NOT_READY(packet)


def test_who_arms_between_readiness_and_arming_keeps_it(bench):
    """The newest HEARTBEAT is from before it."""
    once = OnceReady(bench, lambda: somebody_arms(bench))
    bench.wire.from_shim = once.tamper
    flown = bench.fly()
    assert_left_alone(flown, once.done_s)


def test_a_mode_that_is_chosen_on_the_ground_refuses_the_flight(ardupilot):
    """By the mode switch of a remote control, long after the boot."""
    bench = ardupilot
    bench.wire.from_shim = NOT_READY
    bench.after("ready", 6.0, lambda: bench.wire.change_mode("stabilize"))
    flown = bench.fly()
    assert_refused(flown, "Somebody else chose mode stabilize before arming, in place of guided")
    chosen = flown.began("ready") + 6.0
    assert [main for t, main, _ in flown.wire.mode_requests()] == [GUIDED]
    assert flown.records("event")[-1].time_s - chosen < 1.2
    assert flown.wire.modes[-1][1] == "stabilize"


def test_a_mode_that_is_chosen_between_readiness_and_arming_refuses_the_flight(bench):
    """On PX4, where any mode will do, it is meant as well."""
    mode = {"px4": "posctl", "ardupilot": "loiter"}[bench.flies]
    once = OnceReady(bench, lambda: bench.wire.change_mode(mode))
    bench.wire.from_shim = once.tamper
    flown = bench.fly()
    assert_refused(flown, f"Somebody else chose mode {mode} before arming")
    assert [c for _, c, _ in flown.wire.commands if c == CommandId.COMPONENT_ARM_DISARM] == []


def test_a_failure_after_a_takeover_commands_nothing_of_the_pilots_vehicle(ardupilot, monkeypatch):
    """The pilot flies in GUIDED, as the companion did: that mode is theirs now."""
    from companion.flight.vehicle.connection import Connection

    bench = ardupilot

    def break_it():
        def failing(self, now_s):
            raise KeyError("made up")

        monkeypatch.setattr(Connection, "_keep_up", failing)

    bench.after("track", 1.0, lambda: bench.wire.change_mode("loiter"))
    bench.after("handed over", 1.0, lambda: bench.wire.change_mode("guided"))
    bench.after("handed over", 3.0, break_it)
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    assert "KeyError" in flown.outcome.note
    handed = flown.began("handed over")
    assert [c for t, c, _ in flown.wire.commands if t > handed] == []
    assert flown.wire.modes[-1][1] == "guided"
