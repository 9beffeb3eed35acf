"""`land`, `abort` and `resume` in every phase of a flight."""

import os
import signal
import threading

import pytest

from companion.flight.inbox import PilotCommand
from companion.mavlink.messages import MessageId

BEFORE_ARMING = ("connect", "ready")
ON_GROUND = ("arm",)
IN_FLIGHT = ("take off", "engage", "approach", "track", "return")
DELAY_S = {"take off": 4.0, "engage": 0.4, "land": 2.0}


def fly_with(bench, phase, command, delay_s=None):
    delay_s = DELAY_S.get(phase, 0.0) if delay_s is None else delay_s
    bench.after(phase, delay_s, lambda: bench.inbox.put(command))
    flown = bench.fly(settings={"timeouts.handed_over_s": "2.0"})
    return flown, flown.began(phase) + delay_s


@pytest.mark.parametrize("phase", BEFORE_ARMING)
@pytest.mark.parametrize("command", [PilotCommand.LAND, PilotCommand.ABORT])
def test_before_arming_a_command_refuses_the_flight(bench, phase, command):
    flown, _ = fly_with(bench, phase, command)
    assert flown.outcome.outcome == "refused"
    assert flown.outcome.note == "Stopped by command before arming."
    assert not flown.was_armed
    assert [c for _, c, _ in flown.wire.commands if c == 400] == []


def test_a_command_that_came_before_the_flight_refuses_it(bench):
    bench.inbox.put(PilotCommand.LAND)
    flown = bench.fly()
    assert flown.outcome.outcome == "refused"
    assert not flown.was_armed


def test_a_command_while_arming_leaves_the_vehicle_on_the_ground(bench):
    flown, begun = fly_with(bench, "arm", PilotCommand.LAND)
    assert flown.outcome.outcome == "landed"
    assert not flown.outcome.completed
    assert [p[0] for _, c, p in flown.wire.commands if c == 400] == [1.0, 0.0]
    assert 22 not in [c for _, c, _ in flown.wire.commands]
    assert flown.records("event")[-1].time_s - begun < 2.5
    assert flown.wire.setpoints == []


@pytest.mark.parametrize("phase", IN_FLIGHT)
def test_land_lands_where_the_vehicle_is(bench, phase):
    flown, begun = fly_with(bench, phase, PilotCommand.LAND)
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.note == "landed early by command"
    assert flown.outcome.completed == (phase == "return")
    assert flown.began("land") - begun < 0.02
    assert flown.wire.armed[-1][1] is False
    # The stream goes on until the landing is confirmed, and not beyond.
    assert flown.wire.setpoints_after(begun + 0.5) == []
    if phase == "engage":
        assert (6.0, 0.0) not in [(m, s) for _, m, s in flown.wire.mode_requests()]


@pytest.mark.parametrize("phase", [*IN_FLIGHT, "land"])
def test_abort_stops_commanding_at_once(bench, phase):
    flown, begun = fly_with(bench, phase, PilotCommand.ABORT)
    assert flown.outcome.outcome == "aborted"
    assert "aborted by command" in flown.outcome.note
    assert flown.wire.setpoints_after(begun) == []
    assert [c for t, c, _ in flown.wire.commands if t > begun] == []
    streaming = phase not in ("take off", "land")
    assert ("the setpoint stream stops" in flown.outcome.note) == streaming


@pytest.mark.parametrize("phase", ["ready", *IN_FLIGHT, "land"])
def test_resume_changes_nothing_while_the_companion_flies(bench, phase):
    flown, begun = fly_with(bench, phase, PilotCommand.RESUME)
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    (said,) = flown.told("nothing to resume")
    assert said == pytest.approx(begun, abs=0.02)


def test_a_second_land_is_harmless(bench):
    flown, _ = fly_with(bench, "land", PilotCommand.LAND)
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed


def test_resume_after_an_abort_flies_the_trajectory_anew(bench):
    bench.after("track", 1.0, lambda: bench.inbox.put(PilotCommand.ABORT))
    bench.after("handed over", 0.5, lambda: bench.inbox.put(PilotCommand.RESUME))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.outcome.note == ""


def test_resume_after_the_ladders_end_flies_the_trajectory_anew(bench):
    bench.after("track", 1.0, lambda: bench.wire.cut(1.2, (331,)))
    bench.after("handed over", 1.0, lambda: bench.inbox.put(PilotCommand.RESUME))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed


def test_resume_without_a_state_hands_over_again(bench):
    bench.after("track", 1.0, lambda: bench.wire.cut(None, (331,)))
    bench.after("handed over", 1.0, lambda: bench.inbox.put(PilotCommand.RESUME))
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    assert len([name for _, name in flown.seen.phases if name == "handed over"]) == 2
    requests = [t for t, main, _ in flown.wire.mode_requests() if main == 6.0]
    assert len(requests) == 1  # no second one: nothing could be flown on


def test_the_ground_cannot_be_resumed_from(bench):
    bench.after("track", 1.0, lambda: bench.inbox.put(PilotCommand.ABORT))

    def when_down():
        import asyncio

        if bench.wire.armed[-1][1] and bench.seen_on_ground():
            bench.inbox.put(PilotCommand.RESUME)
        else:
            asyncio.get_running_loop().call_later(0.05, when_down)

    landed = []

    def watch(packet):
        if packet.message_id == MessageId.EXTENDED_SYS_STATE:
            landed.append(packet.payload.ljust(2, b"\0")[1])
        return packet.raw

    bench.wire.from_shim = watch
    bench.seen_on_ground = lambda: landed[-1:] == [1]
    bench.after("handed over", 1.0, when_down)
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    assert flown.told("not resumed: the vehicle is on the ground")
    assert "the autopilot has landed and disarmed" in flown.outcome.note


@pytest.mark.skipif(
    threading.current_thread() is not threading.main_thread(), reason="signals need the main thread"
)
@pytest.mark.parametrize(("presses", "outcome"), [(1, "landed"), (2, "aborted"), (3, "aborted")])
def test_ctrl_c_lands_and_then_hands_over_in_lockstep_too(bench, presses, outcome):
    for k in range(presses):
        bench.after("track", 1.0 + 0.05 * k, lambda: os.kill(os.getpid(), signal.SIGINT))
    flown = bench.fly(settings={"timeouts.handed_over_s": "60"})
    assert flown.outcome.outcome == outcome
    assert "by command" in flown.outcome.note
    assert not flown.outcome.completed
    pressed = flown.began("track") + 1.0
    if presses == 3:  # the last press does not wait for the ground
        assert flown.records("event")[-1].time_s - pressed < 0.3
    else:
        assert flown.wire.armed[-1][1] is False


@pytest.mark.skipif(
    threading.current_thread() is not threading.main_thread(), reason="signals need the main thread"
)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("when", ["before it is known", "after it"])
def test_a_signal_does_not_land_under_a_pilot_who_has_taken_over(bench, number, when):
    """Neither does one that came a moment before the companion heard of the pilot."""

    def interrupt():
        os.kill(os.getpid(), number)

    bench.after("track", 1.0, lambda: bench.wire.change_mode("loiter"))
    if when == "after it":
        bench.after("handed over", 2.0, interrupt)
    else:
        bench.after("handed over", 0.0, lambda: bench.inbox.put(PilotCommand.END))
    flown = bench.fly(settings={"timeouts.handed_over_s": "60"})
    assert flown.outcome.outcome == "aborted"
    assert "aborted by command, the vehicle is left to the autopilot" in flown.outcome.note
    assert len(flown.told("Ctrl-C leaves it to who flies it")) == 1
    handed = flown.began("handed over")
    assert [m for t, *m in flown.wire.mode_requests() if t > handed] == []
    assert flown.wire.armed[-1][1] is True
    assert flown.records("event")[-1].time_s - handed < 2.5


def test_a_take_off_that_was_given_up_is_not_asked_for_again(bench):
    """Nobody answers to the take-off; the person wants to land instead."""

    def lose(packet):
        return b"" if packet.message_id == MessageId.COMMAND_LONG else packet.raw

    def begin():
        bench.wire.to_shim = lose
        bench.wire.restore_after(0.3)

    bench.after("take off", 0.0, begin)
    bench.after("take off", 0.2, lambda: bench.inbox.put(PilotCommand.LAND))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert [c for _, c, _ in flown.wire.commands].count(22) == 1
    assert "takeoff" not in [mode for _, mode in flown.wire.modes]
