"""Leaving an armed ArduPilot: its failsafe for a lost heartbeat must not act under who flies."""

import asyncio
import struct
from contextlib import suppress

import pytest

from companion import lockstep
from companion.flight.check.restore_file import RESTORE_NAME, read_restore_file
from companion.flight.inbox import PilotCommand
from companion.flight.setpoints.setpoint_stream import SetpointStream
from companion.flight.stages import phases
from companion.mavlink.messages import MessageId, Outgoing
from tests.flights.wire import GROUND_STATION

_VALUE = struct.Struct("<fHH16sB")
_AFTERWARDS_S = 8.0
"""FS_GCS_TIMEOUT is 5 s."""
FIX = {"preflight.fix": "true", "timeouts.handed_over_s": "4"}


class Afterwards:
    """Flies an ArduPilot and looks on for a while after the companion has gone."""

    def __init__(self, bench, monkeypatch):
        self.bench = bench
        self.parameters = {}
        """As the vehicle reported them last."""
        self.lost_sets = False
        """What the companion sets is lost on the way."""
        self.heartbeats = []
        """When the companion sent one."""
        self.ended_s = None
        bench.wire.from_shim = self.from_shim
        bench.wire.to_shim = self.to_shim

        async def conduct_and_look_on(*args, **kwargs):
            outcome = await lockstep_conduct(*args, **kwargs)
            self.ended_s = asyncio.get_running_loop().time()
            await asyncio.sleep(_AFTERWARDS_S)
            return outcome

        lockstep_conduct = lockstep.conduct
        monkeypatch.setattr(lockstep, "conduct", conduct_and_look_on)

    def from_shim(self, packet):
        if packet.message_id == MessageId.PARAM_VALUE:
            value, _, _, name, _ = packet.fields(_VALUE)
            self.parameters[name.rstrip(b"\0").decode()] = value
        return packet.raw

    def to_shim(self, packet):
        if packet.message_id == MessageId.HEARTBEAT:
            self.heartbeats.append(packet.time_s)
        if packet.message_id == MessageId.PARAM_SET and self.lost_sets:
            return b""
        return packet.raw

    def pilot_takes_over(self):
        self.bench.wire.change_mode("brake")

    def lose_sets(self, lost=True):
        self.lost_sets = lost

    def fly(self, **options):
        options = {"settings": FIX} | options
        return self.bench.fly(options={"autopilot": "ardupilot"}, **options)

    def modes_since(self, time_s):
        return [name for t, name in self.bench.wire.modes if t > time_s]


@pytest.fixture
def afterwards(bench, monkeypatch):
    return Afterwards(bench, monkeypatch)


def assert_left_in_peace(afterwards, flown, mode="brake"):
    """Still armed long after the companion's end, in the mode that the note names."""
    assert flown.outcome.outcome == "aborted"
    assert afterwards.bench.wire.armed[-1][1] is True
    assert afterwards.bench.wire.modes[-1][1] == mode
    assert "land" not in [name for _, name in afterwards.bench.wire.modes]
    assert afterwards.parameters["FS_GCS_ENABLE"] == 0.0
    assert afterwards.parameters["MAV_GCS_SYSID"] == 255.0


def test_a_pilot_who_took_over_is_left_in_peace_once_nobody_resumes(afterwards):
    afterwards.bench.after("track", 1.0, afterwards.pilot_takes_over)
    flown = afterwards.fly()
    assert_left_in_peace(afterwards, flown)
    assert "the vehicle is left to the autopilot, in mode brake" in flown.outcome.note
    assert flown.told("restored FS_GCS_ENABLE from 5 to 0")
    # What nobody misses stays, and is said.
    (remaining,) = [t for _, _, t in flown.seen.messages if "not restored while" in t]
    assert "restores GUID_TIMEOUT" in remaining
    assert "FS_GCS_ENABLE" not in remaining
    listed = read_restore_file(flown.folder / RESTORE_NAME)
    assert "GUID_TIMEOUT" in [change.name for change in listed.changes]


def test_an_abort_leaves_the_vehicle_in_peace(afterwards):
    afterwards.bench.after("track", 1.0, lambda: afterwards.bench.inbox.put(PilotCommand.ABORT))
    assert_left_in_peace(afterwards, afterwards.fly())


def test_an_abort_after_a_takeover_leaves_the_vehicle_in_peace(afterwards):
    afterwards.bench.after("track", 1.0, afterwards.pilot_takes_over)
    put = afterwards.bench.inbox.put
    afterwards.bench.after("handed over", 1.0, lambda: put(PilotCommand.ABORT))
    assert_left_in_peace(afterwards, afterwards.fly())


@pytest.mark.parametrize("stage", ["take_off", "track", "land"])
def test_an_error_of_our_own_leaves_the_vehicle_in_peace(afterwards, monkeypatch, stage):
    true_stage = getattr(phases, stage)

    async def fail(flight, *args):
        if stage != "land":
            with suppress(TimeoutError):
                await asyncio.wait_for(true_stage(flight, *args), 3.0)
        raise RuntimeError("a bug")

    monkeypatch.setattr(phases, stage, fail)
    flown = afterwards.fly()
    assert "The companion failed (RuntimeError: a bug)" in flown.outcome.note
    assert_left_in_peace(afterwards, flown)


def test_a_helper_of_ours_that_dies_leaves_the_vehicle_in_peace(afterwards, monkeypatch):
    async def die(stream):
        await asyncio.sleep(14.0)
        raise RuntimeError("a bug")

    monkeypatch.setattr(SetpointStream, "watch", die)
    flown = afterwards.fly(check=False)
    assert "The companion failed (RuntimeError: a bug)" in flown.outcome.note
    assert_left_in_peace(afterwards, flown)


def test_while_it_cannot_be_set_back_the_heartbeat_goes_on_until_the_vehicle_is_disarmed(
    afterwards,
):
    afterwards.bench.after("track", 1.0, afterwards.pilot_takes_over)
    afterwards.bench.after("track", 1.0, afterwards.lose_sets)
    afterwards.bench.after("track", 18.0, lambda: afterwards.bench.wire.change_mode("land"))
    flown = afterwards.fly()
    landed_s = flown.wire.armed[-1][0]
    assert flown.wire.armed[-1][1] is False
    (land_s,) = [t for t, name in flown.wire.modes if name == "land"]
    assert land_s >= flown.began("track") + 18.0  # the pilot's, not the failsafe's
    assert max(afterwards.heartbeats) > landed_s - 1.1
    assert len(flown.told("heartbeat goes on until the vehicle is disarmed")) == 1
    assert "the companion's heartbeat went on until it was disarmed" in flown.outcome.note
    assert "left to the autopilot" not in flown.outcome.note


def test_it_is_tried_again_and_then_the_vehicle_can_be_left(afterwards):
    afterwards.bench.after("track", 1.0, afterwards.pilot_takes_over)
    afterwards.bench.after("track", 1.0, afterwards.lose_sets)
    afterwards.bench.after("track", 18.0, lambda: afterwards.lose_sets(False))
    flown = afterwards.fly()
    assert_left_in_peace(afterwards, flown)
    assert flown.began("track") + 18.0 < afterwards.ended_s < flown.began("track") + 30.0


def test_a_person_can_end_the_heartbeat_and_is_told_what_follows(afterwards):
    afterwards.bench.after("track", 1.0, afterwards.pilot_takes_over)
    afterwards.bench.after("track", 1.0, afterwards.lose_sets)
    put = afterwards.bench.inbox.put
    afterwards.bench.after("track", 12.0, lambda: put(PilotCommand.LAND))
    afterwards.bench.after("track", 18.0, lambda: put(PilotCommand.ABORT))
    flown = afterwards.fly()
    assert flown.told("not obeyed (land): the flight is over")
    assert flown.began("track") + 18.0 <= afterwards.ended_s < flown.began("track") + 25.0
    assert "5 s without the companion's heartbeat and the vehicle lands" in flown.outcome.note
    assert afterwards.modes_since(afterwards.ended_s) == ["land"]


OWNERS = {"FS_GCS_ENABLE": 5, "GUID_TIMEOUT": 0.5}


def test_an_owners_failsafe_that_would_miss_everybody_keeps_the_heartbeat(afterwards):
    """It watched a ground station that never came; ours has been heard, and would be missed."""
    afterwards.bench.after("track", 1.0, afterwards.pilot_takes_over)
    afterwards.bench.after("track", 18.0, lambda: afterwards.bench.wire.change_mode("land"))
    flown = afterwards.fly(parameters=OWNERS)
    (land_s,) = [t for t, name in flown.wire.modes if name == "land"]
    assert land_s >= flown.began("track") + 18.0
    (told,) = [t for _, _, t in flown.seen.messages if "heartbeat goes on" in t]
    assert "System 255, which was watched before, is not heard" in told
    assert afterwards.parameters["MAV_GCS_SYSID"] == 255.0  # once it stood
    assert afterwards.parameters["FS_GCS_ENABLE"] == 5.0


def test_an_owners_ground_station_that_is_there_is_watched_again(afterwards):
    wire, took_over = afterwards.bench.wire, []
    station = struct.pack("<IBBBBB", 0, 6, 8, 0, 4, 3)

    def with_station(packet):
        raw = afterwards.from_shim(packet)
        if packet.message_id == MessageId.HEARTBEAT and took_over:
            heartbeat = Outgoing(MessageId.HEARTBEAT, station)
            wire.send_to_vehicle(heartbeat)
            return raw + GROUND_STATION.pack(heartbeat)
        return raw

    wire.from_shim = with_station
    afterwards.bench.after("track", 0.0, lambda: took_over.append(True))
    afterwards.bench.after("track", 1.0, afterwards.pilot_takes_over)
    flown = afterwards.fly(parameters=OWNERS)
    assert afterwards.parameters["MAV_GCS_SYSID"] == 255.0
    assert flown.told("restored MAV_GCS_SYSID from 1 to 255")
    assert "the vehicle is left to the autopilot, in mode brake" in flown.outcome.note


def test_without_a_failsafe_that_watches_us_nothing_is_set_or_waited_for(afterwards):
    afterwards.bench.after("track", 1.0, afterwards.pilot_takes_over)
    flown = afterwards.fly(settings={"timeouts.handed_over_s": "4"})
    assert flown.outcome.outcome == "aborted"
    assert not any("heartbeat goes on" in text for _, _, text in flown.seen.messages)
    assert afterwards.ended_s == pytest.approx(flown.began("handed over") + 4.0, abs=0.2)
