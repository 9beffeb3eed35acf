"""What is wrong before the flight refuses it, and nothing is armed."""

import struct

import pytest

from companion.mavlink.messages import MessageId, Outgoing
from tests.flights.wire import _COMMAND, _HEARTBEAT, AUTOPILOT

_SYS_STATUS = struct.Struct("<3I")
_PREARM = 0x1000_0000
SET_MODE = 176
ARM = 400
_ACK = struct.Struct("<HBBiBB")


def edit(message_id, layout, change):
    """A tamper that changes fields of one kind of the vehicle's messages."""

    def tamper(packet):
        if packet.message_id != message_id or packet.component_id != AUTOPILOT:
            return packet.raw
        fields = change(*packet.fields(layout))
        rest = packet.payload.ljust(layout.size, b"\0")[layout.size :]
        return packet.with_payload(layout.pack(*fields) + rest)

    return tamper


def assert_refused(flown, text):
    assert flown.outcome.outcome == "refused"
    assert text in flown.outcome.note
    assert not flown.was_armed
    assert flown.outcome.scored_s is None
    assert flown.wire.setpoints == []
    assert flown.records("event")[-1].values["text"] == flown.outcome.note


def test_no_autopilot(bench):
    bench.wire.from_shim = lambda packet: b""
    flown = bench.fly(settings={"timeouts.connect_s": "3"})
    assert_refused(flown, "No HEARTBEAT of an autopilot came over the embedded shim")
    assert flown.wire.commands == []


def test_an_autopilot_without_a_state(bench):
    bench.wire.cut(None, (MessageId.ODOMETRY,))
    flown = bench.fly(settings={"timeouts.connect_s": "3"})
    assert_refused(flown, "there came no ODOMETRY")


def test_an_autopilot_whose_state_is_not_a_number(bench):
    layout = struct.Struct("<Q3f")
    nan = float("nan")
    bench.wire.from_shim = edit(MessageId.ODOMETRY, layout, lambda t, x, y, z: (t, nan, y, z))
    flown = bench.fly(settings={"timeouts.connect_s": "3"})
    assert_refused(flown, "no usable ODOMETRY (ODOMETRY has an impossible position")


def test_an_autopilot_of_another_kind(bench):
    bench.wire.from_shim = edit(
        MessageId.HEARTBEAT, _HEARTBEAT, lambda mode, kind, _, *rest: (mode, kind, 3, *rest)
    )
    flown = bench.fly(options={"autopilot": "px4"})
    assert_refused(flown, "has MAV_AUTOPILOT 3, which is ArduPilot; px4 has 12")
    assert "Give --autopilot ardupilot, or auto." in flown.outcome.note
    assert flown.wire.commands == []


def test_an_autopilot_that_the_companion_does_not_know(bench):
    bench.wire.from_shim = edit(
        MessageId.HEARTBEAT, _HEARTBEAT, lambda mode, kind, _, *rest: (mode, kind, 0, *rest)
    )
    flown = bench.fly()
    assert_refused(flown, "MAV_AUTOPILOT 0, of which the companion knows nothing")
    assert "px4 and ardupilot" in flown.outcome.note
    assert flown.wire.commands == []


def test_a_vehicle_that_is_armed_already(bench):
    bench.wire.from_shim = edit(
        MessageId.HEARTBEAT,
        _HEARTBEAT,
        lambda mode, kind, kind2, base, *rest: (mode, kind, kind2, base | 0x80, *rest),
    )
    flown = bench.fly()
    assert_refused(flown, "The vehicle is armed already")
    assert flown.wire.commands == []


def test_an_autopilot_that_never_becomes_ready(bench):
    bench.wire.from_shim = edit(
        MessageId.SYS_STATUS, _SYS_STATUS, lambda p, e, h: (p, e, h & ~_PREARM & ~0x20)
    )
    flown = bench.fly(settings={"timeouts.ready_s": "5"})
    assert_refused(flown, "did not become ready within 5 s. It waits for: GPS")
    assert [c for _, c, _ in flown.wire.commands if c == 400] == []


def test_arming_that_is_denied(bench):
    """The autopilot looks ready, and is not."""

    def deny(packet):
        if packet.message_id == MessageId.COMMAND_LONG and packet.fields(_COMMAND)[7] == ARM:
            denied = _ACK.pack(ARM, 1, 0, 0, 1, 191)
            bench.wire.send_to_companion(Outgoing(MessageId.COMMAND_ACK, denied))
            return b""
        return packet.raw

    bench.wire.to_shim = deny
    flown = bench.fly()
    assert_refused(flown, "Arming was denied: the autopilot refused COMPONENT_ARM_DISARM")


def test_arming_that_is_never_answered_is_taken_back(bench):
    """Only the answers are lost: the vehicle may be armed, and so it is told to disarm."""
    bench.wire.from_shim = lambda p: b"" if p.message_id == MessageId.COMMAND_ACK else p.raw
    lose = bench.wire.from_shim
    bench.wire.from_shim = None

    def begin():
        armed = edit(
            MessageId.HEARTBEAT,
            _HEARTBEAT,
            lambda mode, kind, kind2, base, *rest: (mode, kind, kind2, base & ~0x80, *rest),
        )
        bench.wire.from_shim = lambda p: lose(p) and armed(p)

    bench.after("arm", 0.0, begin)
    flown = bench.fly()
    assert flown.outcome.outcome == "refused"
    assert "no COMMAND_ACK" in flown.outcome.note
    assert flown.wire.commands[-1][2][0] == 0.0  # the last word was to disarm


def test_a_link_that_is_lost_before_arming(bench):
    bench.after("ready", 0.0, lambda: bench.wire.cut(None))
    flown = bench.fly()
    assert_refused(flown, "the link is lost")


@pytest.mark.parametrize("settings", [{"timeouts.link_lost_s": "2.0"}])
def test_a_link_that_is_lost_while_arming_is_no_refusal(bench, settings):
    """Nobody knows whether the vehicle is armed."""
    bench.after("arm", 0.0, lambda: bench.wire.cut(None))
    flown = bench.fly(settings=settings)
    assert flown.outcome.outcome == "aborted"
    assert "the link is lost" in flown.outcome.note


def test_take_off_that_is_refused_leaves_the_vehicle_disarmed(bench):
    """The command is lost; four attempts get no answer."""

    def lose(packet):
        return b"" if packet.message_id == MessageId.COMMAND_LONG else packet.raw

    def begin():
        bench.wire.to_shim = lose
        bench.wire.restore_after(2.2)

    bench.after("take off", 0.0, begin)
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    assert "Take-off was refused: no COMMAND_ACK" in flown.outcome.note
    assert flown.wire.armed[-1][1] is False
    assert flown.wire.setpoints == []


def test_setpoints_that_the_autopilot_does_not_take_end_in_a_landing(bench):
    """PX4 refuses the mode because no stream reaches it."""
    bench.wire.to_shim = lambda p: b"" if p.message_id == MessageId.SET_ATTITUDE_TARGET else p.raw
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    assert "does not take setpoints" in flown.outcome.note
    assert "The vehicle was landed." in flown.outcome.note
    assert flown.wire.armed[-1][1] is False
    assert flown.wire.setpoints_after(flown.began("land")) == []


def test_a_landing_that_the_autopilot_does_not_begin_is_left_to_it(bench):
    def lose_requests(packet):
        return b"" if packet.message_id == MessageId.COMMAND_LONG else packet.raw

    bench.after("land", 0.0, lambda: setattr(bench.wire, "to_shim", lose_requests))
    flown = bench.fly(settings={"timeouts.handed_over_s": "15"})
    assert flown.outcome.outcome == "aborted"
    assert flown.outcome.completed
    begun = flown.began("land")
    # Asked three times, then the stream stops and the failsafe brings it down.
    assert len([t for t, _, _ in flown.wire.mode_requests() if t >= begun]) == 3
    (said,) = flown.told("handed over: the autopilot did not acknowledge the change to mode land")
    assert flown.wire.setpoints_after(said) == []


def test_a_controller_that_the_vehicles_file_says_too_little_for_under_this_autopilot(bench):
    """PX4 takes thrust, and the file knows only how this vehicle answers a climb rate."""
    flown = bench.fly(options={"vehicle": "arducopter", "controller": "mpc-l1-plus"})
    assert_refused(flown, "mpc-l1-plus commands thrust here, and the file of 'arducopter' does not")
    assert flown.outcome.note.startswith("mpc-l1-plus ")
