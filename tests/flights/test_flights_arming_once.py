"""What has armed is not armed again: not when it has been disarmed, and not for a lost answer."""

import pytest

from companion.mavlink.commands import CommandId
from companion.mavlink.messages import MessageId
from tests.flights.wire import _COMMAND, _HEARTBEAT, AUTOPILOT

ARM, TAKE_OFF = CommandId.COMPONENT_ARM_DISARM, CommandId.NAV_TAKEOFF
HEARTBEAT_S = 1.0
LOST_S = 2.0


@pytest.fixture(params=["px4", "ardupilot"])
def bench(bench, request):
    bench.flies = request.param
    return bench


def sent(flown, command_id):
    """Times at which a command was sent; of arming and disarming, those that arm."""
    return [t for t, c, p in flown.wire.commands if c == command_id and (c != ARM or p[0] != 0.0)]


def says_armed(packet):
    is_heartbeat = packet.message_id == MessageId.HEARTBEAT and packet.component_id == AUTOPILOT
    return is_heartbeat and bool(packet.fields(_HEARTBEAT)[3] & 0x80)


def loses_answers(packet):
    return b"" if packet.message_id == MessageId.COMMAND_ACK else packet.raw


def arms(packet):
    if packet.message_id != MessageId.COMMAND_LONG:
        return False
    fields = packet.fields(_COMMAND)
    return fields[7] == ARM and fields[0] != 0.0


class OnceSeenArmed:
    """Loses the answers, and disarms with the first HEARTBEAT that says armed."""

    def __init__(self, bench):
        self.bench = bench
        self.done_s = None

    def tamper(self, packet):
        if says_armed(packet) and self.done_s is None:
            self.done_s = packet.time_s
            self.bench.wire.disarm_by_force()
        return loses_answers(packet)


def disarms_behind(bench):
    """Lets everything through, and disarms right behind what arms."""

    def tamper(packet):
        if arms(packet):
            bench.wire.disarm_by_force()
        return packet.raw

    return tamper


def assert_left_disarmed(flown):
    assert flown.outcome.outcome == "aborted"
    assert "The vehicle was disarmed" in flown.outcome.note
    assert "not by the companion" in flown.outcome.note
    assert len(sent(flown, ARM)) == 1
    assert [armed for _, armed in flown.wire.armed][-1] is False
    assert flown.wire.setpoints == []


def test_a_vehicle_that_is_disarmed_after_it_was_seen_armed_is_not_armed_again(bench):
    """No answer to arming ever comes: what has been seen is not asked for again."""
    once = OnceSeenArmed(bench)
    bench.after("arm", 0.0, lambda: setattr(bench.wire, "from_shim", once.tamper))
    flown = bench.fly()
    assert [armed for _, armed in flown.wire.armed] == [False, True, False]
    assert_left_disarmed(flown)
    # The next HEARTBEAT ends it.
    assert flown.records("event")[-1].time_s - once.done_s < HEARTBEAT_S + 0.2


def test_a_vehicle_that_is_disarmed_before_it_was_seen_armed_is_not_flown(bench):
    """Arming is accepted, and the first HEARTBEAT after it says disarmed."""

    def begin():
        bench.wire.to_shim = disarms_behind(bench)

    bench.after("arm", 0.0, begin)
    flown = bench.fly()
    assert_left_disarmed(flown)
    assert sent(flown, TAKE_OFF) == []
    assert flown.records("event")[-1].time_s - flown.began("arm") < 2.0 * HEARTBEAT_S


def test_a_text_is_enough_where_the_answer_and_the_armed_heartbeat_are_lost(bench):
    """Of an arming that somebody undoes at once nothing else arrives."""
    if bench.flies == "px4":
        pytest.skip("PX4 sends its texts to ground stations alone")

    def begin():
        bench.wire.to_shim = disarms_behind(bench)
        bench.wire.from_shim = loses_answers

    bench.after("arm", 0.0, begin)
    flown = bench.fly()
    assert_left_disarmed(flown)
    assert sent(flown, TAKE_OFF) == []


def test_a_heartbeat_that_says_armed_counts_as_the_answer(bench):
    """The first request is lost, and then all answers for 2 s: it arms, and flies."""
    lost = []

    def loses_the_first(packet):
        if arms(packet) and not lost:
            lost.append(packet.time_s)
            return b""
        return packet.raw

    def begin():
        bench.wire.from_shim, bench.wire.to_shim = loses_answers, loses_the_first
        bench.wire.restore_after(LOST_S)

    bench.after("arm", 0.0, begin)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    first, second = sent(flown, ARM)
    assert [first] == lost
    # On the word of a HEARTBEAT that came later than the answer would have.
    assert 0.5 <= second - first <= HEARTBEAT_S + 0.7
    seen = next(t for t, armed in flown.wire.armed if armed)
    assert flown.began("take off") - seen < 0.1
