"""Somebody else takes the vehicle over, or it is disarmed: the companion never fights."""

import struct

import pytest

from companion.flight.inbox import PilotCommand
from companion.mavlink.messages import MessageId, Outgoing, Severity, status_texts
from tests.flights.wire import AUTOPILOT

WAIT = {"timeouts.handed_over_s": "3.0"}
"""Nobody says a word for so long: then the flight ends."""
CURRENT_MODE_S = 0.1


@pytest.mark.parametrize(
    ("phase", "mode"),
    [
        ("take off", "land"),
        ("engage", "rtl"),
        ("approach", "loiter"),
        ("track", "land"),
        ("track", "loiter"),
        ("return", "rtl"),
        ("land", "loiter"),
    ],
)
def test_a_mode_that_somebody_else_chose_stops_the_stream_at_once(bench, phase, mode):
    delay_s = 4.0 if phase == "take off" else 0.6
    bench.after(phase, delay_s, lambda: bench.wire.change_mode(mode))
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    changed = flown.began(phase) + delay_s
    (said,) = flown.told("handed over: somebody else changed the mode to " + mode)
    assert said - changed < CURRENT_MODE_S + 0.15
    assert flown.wire.setpoints_after(said) == []
    # Nothing is sent that would take the vehicle back.
    assert [c for t, c, _ in flown.wire.commands if t > changed + 0.1] == []
    assert flown.wire.modes[-1][1] in (mode, "loiter")  # PX4 holds once it has landed


def test_nothing_resumes_by_itself_after_a_takeover(bench):
    bench.after("track", 1.0, lambda: bench.wire.change_mode("loiter"))
    flown = bench.fly(settings={"timeouts.handed_over_s": "20.0"})
    (said,) = flown.told("handed over: somebody else")
    assert flown.wire.setpoints_after(said) == []
    assert flown.records("event")[-1].time_s - said > 19.0
    assert "nobody resumed within 20 s" in flown.outcome.note


def test_a_person_can_resume_after_a_takeover(bench):
    bench.after("track", 1.0, lambda: bench.wire.change_mode("loiter"))
    bench.after("handed over", 2.0, lambda: bench.inbox.put(PilotCommand.RESUME))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert [name for _, name in flown.seen.phases].count("track") == 2
    start, end = flown.outcome.scored_s
    assert start > flown.began("handed over")
    assert end > start
    # It returns to where it took off, not to where it resumed.
    last = [r.values for r in flown.records("control") if r.values["phase"] == "settle"][-1]
    assert abs(last["position_enu_m"][0]) < 0.15
    assert abs(last["position_enu_m"][1]) < 0.15


@pytest.mark.parametrize("word", [PilotCommand.LAND, PilotCommand.ABORT])
def test_a_person_can_end_the_flight_after_a_takeover(bench, word):
    bench.after("track", 1.0, lambda: bench.wire.change_mode("loiter"))
    bench.after("handed over", 1.0, lambda: bench.inbox.put(word))
    flown = bench.fly()
    if word is PilotCommand.LAND:
        assert flown.outcome.outcome == "landed"
        assert flown.outcome.note == "landed early by command"
        assert flown.wire.armed[-1][1] is False
    else:
        assert flown.outcome.outcome == "aborted"
        assert "aborted by command" in flown.outcome.note
        end = flown.records("event")[-1].time_s
        assert end - flown.began("handed over") < 1.1
    assert not flown.outcome.completed


def test_landing_is_not_repeated_against_a_person(bench):
    """The first request for landing is lost; before the second a person takes over."""

    def lose_requests(packet):
        return b"" if packet.message_id == MessageId.COMMAND_LONG else packet.raw

    def begin():
        bench.wire.to_shim = lose_requests
        bench.wire.change_mode("loiter")

    bench.after("land", 0.0, begin)
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    begun = flown.began("land")
    assert len([t for t, _, _ in flown.wire.mode_requests() if t >= begun]) == 1


def test_a_vehicle_that_is_disarmed_in_flight_gets_no_more_setpoints(bench):
    bench.after("track", 1.0, bench.wire.disarm_by_force)
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    (said,) = flown.told("The vehicle was disarmed")
    assert said - flown.began("track") < 1.0 + 1.1  # HEARTBEAT comes once a second
    assert flown.wire.setpoints_after(said) == []
    assert [c for t, c, _ in flown.wire.commands if t > flown.began("track")] == []


def test_setpoints_that_are_lost_for_a_moment_do_no_harm(bench):
    def lose(packet):
        return b"" if packet.message_id == MessageId.SET_ATTITUDE_TARGET else packet.raw

    def begin():
        bench.wire.to_shim = lose
        bench.wire.restore_after(0.3)

    bench.after("track", 1.0, begin)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed


def test_setpoints_that_are_lost_end_with_the_autopilots_failsafe_and_no_fight(bench):
    def lose(packet):
        return b"" if packet.message_id == MessageId.SET_ATTITUDE_TARGET else packet.raw

    bench.after("track", 1.0, lambda: setattr(bench.wire, "to_shim", lose))
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    (said,) = flown.told("handed over: somebody else changed the mode to posctl")
    assert said - flown.began("track") - 1.0 < 1.4
    assert flown.wire.setpoints_after(said) == []


def test_what_the_autopilot_says_is_shown_and_logged(bench):
    text = "Failsafe warning: this text is longer than the fifty characters of one packet"

    def speak():
        for chunk in status_texts(Severity.CRITICAL, text, 9):
            bench.wire.send_to_companion(chunk)
        for chunk in status_texts(Severity.INFO, "short\t"):
            bench.wire.send_to_companion(chunk)

    bench.after("track", 1.0, speak)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    said = {(severity, text) for _, severity, text in flown.seen.messages}
    assert ("error", f"the autopilot says: {text}") in said
    assert ("info", "the autopilot says: short") in said
    echoed = [said for said in flown.wire.texts if "short" in said or "Failsafe warning" in said]
    assert echoed == []


def test_a_wrong_message_of_the_vehicle_does_not_stop_the_rest(bench, monkeypatch):
    """Whatever a message does to its reader, the state behind it is still flown on."""
    from companion.flight.vehicle.reports import Reports

    take = Reports.take

    def failing(self, frame):
        if frame.message_id == MessageId.EXTENDED_SYS_STATE and self.armed:
            raise ValueError("made up")
        take(self, frame)

    monkeypatch.setattr(Reports, "take", failing)
    flown = bench.fly(settings={"timeouts.takeoff_s": "9.0"})
    assert len(flown.told("EXTENDED_SYS_STATE could not be dealt with (ValueError: made up)")) == 1
    # Without it nobody knows that the take-off is over: it is given up and landed.
    assert flown.outcome.outcome == "aborted"
    assert "The take-off did not end" in flown.outcome.note
    assert flown.wire.armed[-1][1] is False


def test_what_the_autopilot_answers_to_somebody_else_is_not_our_answer(bench):
    """A ground station's request is refused while ours is pending on the same link."""
    refused = struct.Struct("<HBBiBB")

    def answer_others():
        bench.wire.send_to_companion(
            Outgoing(MessageId.COMMAND_ACK, refused.pack(176, 1, 0, 0, 255, 190))
        )

    bench.after("engage", 1.005, answer_others)
    bench.after("land", 0.005, answer_others)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed


def test_a_state_in_the_same_datagram_as_the_takeover_is_not_flown_on(bench):
    held = []

    def join(packet):
        """Reports of the mode travel in one datagram with the state that follows them."""
        if packet.component_id == AUTOPILOT and packet.message_id == MessageId.CURRENT_MODE:
            held.append(packet.raw)
            return b""
        if packet.component_id == AUTOPILOT and packet.message_id == MessageId.ODOMETRY:
            joined = b"".join([*held, packet.raw])
            held.clear()
            return joined
        return packet.raw

    def begin():
        bench.wire.from_shim = join
        bench.wire.change_mode("loiter")

    bench.after("track", 1.0, begin)
    flown = bench.fly(settings=WAIT)
    (said,) = flown.told("handed over: somebody else changed the mode to loiter")
    assert all(s.time_s < said for s in flown.wire.setpoints)
