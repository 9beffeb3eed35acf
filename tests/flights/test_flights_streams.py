"""Streams are asked for, then measured: what an autopilot grants is not what it sends."""

import struct

import pytest

from companion.mavlink.commands import CommandId
from companion.mavlink.messages import MessageId, Outgoing
from tests.flights.test_flights_refusals import assert_refused
from tests.flights.wire import AUTOPILOT

_LONG = struct.Struct("<7fHBBB")
_ACK = struct.Struct("<HBBiBB")
_DENIED = 2
PARTS = {MessageId.LOCAL_POSITION_NED, MessageId.ATTITUDE_QUATERNION}


def thin_out(message_ids, kept_of):
    """Let one of so many messages through, of each kind."""
    seen = dict.fromkeys(message_ids, 0)

    def tamper(packet):
        if packet.message_id in seen and packet.component_id == AUTOPILOT:
            seen[packet.message_id] += 1
            if seen[packet.message_id] % kept_of:
                return b""
        return packet.raw

    return tamper


def refuse_interval(wire, message_id):
    """The autopilot denies an interval for this message, and sends none."""

    def tamper(packet):
        if packet.message_id == MessageId.COMMAND_LONG:
            *parameters, command, _, _, _ = packet.fields(_LONG)
            if command == CommandId.SET_MESSAGE_INTERVAL and parameters[0] == message_id:
                answer = _ACK.pack(command, _DENIED, 0, 0, 1, 191)
                wire.send_to_companion(Outgoing(MessageId.COMMAND_ACK, answer))
                return b""
        return packet.raw

    wire.to_shim = tamper
    wire.from_shim = lambda p: (
        b"" if p.message_id == message_id and p.component_id == AUTOPILOT else p.raw
    )


def intervals_asked(flown):
    return [int(p[0]) for _, c, p in flown.wire.commands if c == CommandId.SET_MESSAGE_INTERVAL]


def test_a_px4_that_refuses_odometry_is_flown_on_position_and_attitude(bench):
    refuse_interval(bench.wire, MessageId.ODOMETRY)
    bench.wire.state_message = MessageId.LOCAL_POSITION_NED
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    assert flown.outcome.fallbacks == 0
    assert set(intervals_asked(flown)) >= PARTS
    assert len(flown.records("control")) > 500


def test_where_odometry_is_granted_nothing_else_is_asked_for_the_state(bench):
    flown = bench.fly(airborne=True)
    assert not PARTS & set(intervals_asked(flown))


def test_a_state_that_comes_somewhat_slowly_is_told_with_the_remedy(bench):
    bench.wire.from_shim = thin_out((MessageId.ODOMETRY,), 2)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert len(flown.told("the state (ODOMETRY) arrives at 50 Hz, 100 Hz were asked for")) == 1
    assert len(flown.told("SER_*_BAUD")) == 1


@pytest.mark.parametrize(
    ("autopilot", "message", "remedy"),
    [
        ("px4", MessageId.ODOMETRY, "MAV_n_RATE"),
        ("ardupilot", MessageId.LOCAL_POSITION_NED, "SERIALn_BAUD"),
    ],
)
def test_a_state_that_is_too_slow_to_fly_on_is_refused(bench, autopilot, message, remedy):
    bench.flies = autopilot
    bench.wire.from_shim = thin_out((message,), 5)
    flown = bench.fly()
    assert_refused(flown, "Hz, 100 Hz were asked for (at least 30 Hz of the state are needed")
    assert message.name in flown.outcome.note
    assert remedy in flown.outcome.note


def test_body_rates_need_a_faster_state(bench):
    bench.wire.from_shim = thin_out((MessageId.ODOMETRY,), 3)
    assert_refused(
        bench.fly(options={"setpoint": "rates"}), "50 Hz of the state are needed for rates"
    )


@pytest.mark.parametrize("message", [MessageId.EXTENDED_SYS_STATE, MessageId.SYS_STATUS])
def test_a_needed_stream_that_is_granted_and_stays_silent_is_refused_by_name(bench, message):
    bench.wire.from_shim = lambda p: b"" if p.message_id == message else p.raw
    flown = bench.fly()
    assert_refused(flown, f"{message.name} was granted and does not arrive")
    # It was asked for once more first: a request can be lost.
    assert intervals_asked(flown).count(int(message)) == 2


def test_a_needed_stream_that_is_slow_is_told_and_flown_with(bench):
    bench.wire.from_shim = thin_out((MessageId.EXTENDED_SYS_STATE,), 5)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert len(flown.told("EXTENDED_SYS_STATE arrives at 2 Hz, 5 Hz were asked for")) == 1


@pytest.mark.parametrize(("autopilot", "within_s"), [("px4", 1.9), ("ardupilot", 3.0)])
def test_the_streams_are_measured_while_the_check_asks(bench, autopilot, within_s):
    """Of an autopilot that is ready already; on ArduPilot questions go unanswered."""
    bench.wire.from_shim = lambda p: p.raw if p.time_s > 12.0 else b""
    flown = bench.fly(options={"autopilot": autopilot}, check=False)
    assert flown.outcome.outcome == "landed", flown.outcome.note
    asked_s = next(t for t, c, _ in flown.wire.commands if c == CommandId.SET_MESSAGE_INTERVAL)
    assert 1.0 < flown.began("ready") - asked_s < within_s


def test_a_slow_state_is_told_once(bench):
    flown = bench.fly(parameters={"EKF2_PREDICT_US": 20000})
    assert flown.outcome.outcome == "landed", flown.outcome.note
    warnings = [text for _, severity, text in flown.seen.messages if severity == "warning"]
    assert len(warnings) == 1
    assert warnings[0].startswith("the state (ODOMETRY) arrives at 50 Hz")


def test_a_state_that_is_slow_only_while_the_check_asks_is_not_told(bench):
    """Answers took its room on the link."""
    answered = []
    thin = thin_out((MessageId.ODOMETRY,), 2)

    def crowd(packet):
        if packet.message_id == MessageId.PARAM_VALUE:
            answered.append(packet.time_s)
        crowded = not answered or packet.time_s < answered[0] + 0.7
        return thin(packet) if crowded else packet.raw

    bench.wire.from_shim = crowd
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert not any("arrives at" in text for _, _, text in flown.seen.messages)
    assert intervals_asked(flown).count(int(MessageId.ODOMETRY)) == 1


def test_the_first_questions_are_repeated_as_a_bad_link_needs(bench):
    unanswered = 8

    def lose_answers(packet):
        nonlocal unanswered
        if packet.message_id != MessageId.COMMAND_ACK or unanswered == 0:
            return packet.raw
        unanswered -= 1
        return b""

    bench.wire.from_shim = lose_answers
    flown = bench.fly(airborne=True)
    assert unanswered == 0
    assert flown.outcome.outcome == "tracked"
