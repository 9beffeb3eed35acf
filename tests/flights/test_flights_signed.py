"""Flights under a signing key: with it all is as ever, without it nothing is obeyed."""

import struct

from companion.mavlink.codec import Packer
from companion.mavlink.dialects.px4 import Px4
from companion.mavlink.messages import MessageId, Outgoing
from companion.recording.flight_log import TLOG_NAME
from companion.recording.tlog import read_tlog
from tests.flights.bench import Bench

KEY, OTHER_KEY = bytes(range(32)), bytes(range(1, 33))


def assert_nothing_was_obeyed(flown):
    assert flown.outcome.outcome == "refused"
    assert not flown.was_armed
    assert flown.wire.setpoints == []
    assert {name for _, name in flown.wire.modes} == {"loiter"}


def test_a_signed_flight_lands_and_every_packet_is_signed(bench):
    unsigned = []

    def note(packet):
        if not packet.raw[2] & 1:
            unsigned.append(packet)
        return packet.raw

    bench.wire.from_shim = bench.wire.to_shim = note
    flown = bench.fly(key=KEY, shim_key=KEY)

    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.outcome.note == ""
    assert flown.outcome.fallbacks == 0
    assert flown.outcome.rejected_packets == {}
    assert unsigned == []


def test_signing_changes_nothing_of_what_is_flown(bench, tmp_path):
    signed = bench.fly(key=KEY, shim_key=KEY)
    (tmp_path / "plain").mkdir()
    plain = Bench(tmp_path / "plain").fly()

    assert signed.wire.setpoints == plain.wire.setpoints
    assert plain.outcome.rejected_packets is None


def test_without_the_key_nothing_is_obeyed_and_the_refusal_says_why(bench):
    flown = bench.fly(shim_key=KEY)

    assert_nothing_was_obeyed(flown)
    assert "no COMMAND_ACK" in flown.outcome.note
    assert "The autopilot's packets are signed, and no key was given here" in flown.outcome.note
    assert "--signing-key-file or COMPANION_SIGNING_KEY" in flown.outcome.note
    assert len(flown.told("The autopilot's packets are signed")) == 2  # at once, and at the end


def test_with_another_key_nothing_is_obeyed_and_the_refusal_says_why(bench):
    flown = bench.fly(key=OTHER_KEY, shim_key=KEY)

    assert_nothing_was_obeyed(flown)
    assert "the vehicle has another one" in flown.outcome.note
    assert list(flown.outcome.rejected_packets) == ["badly signed"]
    assert flown.outcome.rejected_packets["badly signed"] > 100
    assert flown.wire.commands == []
    assert list(read_tlog(flown.folder / TLOG_NAME)) == []


def test_a_vehicle_without_a_key_is_not_flown_with_one(bench):
    flown = bench.fly(key=KEY)

    assert_nothing_was_obeyed(flown)
    assert "they are not signed: give the vehicle the key" in flown.outcome.note
    assert list(flown.outcome.rejected_packets) == ["unsigned"]


def test_others_on_the_link_are_neither_heard_nor_obeyed(bench):
    """Somebody without the key feigns the vehicle, and commands it; somebody repeats packets."""
    recorded = []

    def record(packet):
        if packet.message_id == MessageId.HEARTBEAT and packet.component_id == 1:
            recorded.append(packet.raw)
        return packet.raw

    def attack():
        bench.wire.change_mode("land")
        bench.wire.disarm_by_force()
        feigned = Packer(1, 1)
        for mode in ("land", "rtl"):
            payload = struct.pack("<IBBBBB", Px4().custom_mode(mode), 2, 12, 0x9D, 4, 3)
            bench.wire._from_shim_too.append(feigned.pack(Outgoing(MessageId.HEARTBEAT, payload)))
        bench.wire._from_shim_too.extend(recorded[:3])

    bench.wire.from_shim = record
    bench.after("track", 0.5, attack)
    flown = bench.fly(key=KEY, shim_key=KEY)

    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.outcome.rejected_packets == {"replayed": 3, "unsigned": 2}
    assert len(flown.told("was not read, as all such will be: it is not signed")) == 1
    assert len(flown.told("was not read, as all such will be: it carries an old stamp")) == 1


def test_a_recorded_command_sent_again_is_not_obeyed(bench):
    """The companion's own take-off command, in the middle of the flight."""
    recorded = []

    def record(packet):
        if packet.message_id == MessageId.COMMAND_LONG:
            recorded.append(packet.raw)
        return packet.raw

    bench.wire.to_shim = record
    bench.after("track", 0.5, lambda: bench.wire._to_shim_too.extend(recorded))
    flown = bench.fly(key=KEY, shim_key=KEY)

    assert len(recorded) > 5
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.outcome.fallbacks == 0
