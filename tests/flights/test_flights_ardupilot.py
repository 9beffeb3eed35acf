"""Flights on ArduPilot's manners: GUIDED, streams that must be asked for, BRAKE at a hand-over."""

import asyncio
import math
import struct
from itertools import pairwise

import pytest

from companion.flight.inbox import PilotCommand
from companion.frames import quaternion_from_euler, quaternion_multiply
from companion.mavlink.commands import CommandId, message_interval
from companion.mavlink.messages import MessageId, Outgoing, Severity, Target, status_texts
from tests.flights.test_flights_refusals import assert_refused, edit
from tests.flights.wire import _HEARTBEAT, AUTOPILOT

WAIT = {"timeouts.handed_over_s": "3.0"}
"""Nobody says a word for so long: then the flight ends."""
GUIDED, LAND, BRAKE = 4.0, 9.0, 17.0
_ACK = struct.Struct("<HBBiBB")


@pytest.fixture
def bench(bench):
    bench.flies = "ardupilot"
    return bench


def asked(flown, command):
    return [(t, p) for t, c, p in flown.wire.commands if c == command]


def modes_asked(flown, since_s=0.0):
    return [main for t, main, _ in flown.wire.mode_requests() if t >= since_s]


def seconds_between(setpoints):
    return [b.time_s - a.time_s for a, b in pairwise(setpoints)]


@pytest.mark.parametrize("autopilot", ["auto", "ardupilot"])
def test_a_whole_flight_lands_with_its_trajectory_flown(bench, autopilot):
    flown = bench.fly(options={"autopilot": autopilot})
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    assert flown.outcome.note == ""
    names = [name for _, name in flown.wire.modes]
    assert names[-2:] == ["guided", "land"]
    assert flown.wire.armed[-1][1] is False
    # Intervals first, then GUIDED, then arming and the take-off with its height.
    ((armed_s, _),) = asked(flown, CommandId.COMPONENT_ARM_DISARM)
    ((takeoff_s, takeoff),) = asked(flown, CommandId.NAV_TAKEOFF)
    assert max(t for t, _ in asked(flown, CommandId.SET_MESSAGE_INTERVAL)) < armed_s < takeoff_s
    assert takeoff[6] == 2.5
    assert modes_asked(flown)[0] == GUIDED
    assert modes_asked(flown)[-1] == LAND
    # GUIDED obeys at once: the controller flies from the first setpoints on.
    engaged = flown.began("engage")
    assert flown.began("approach") - engaged < 0.2
    # Closely spaced, each on a sample; the bursts of a real one are at most 16 ms late.
    tracked = [s for s in flown.wire.setpoints if s.time_s < flown.began("land")]
    assert max(seconds_between(tracked)) < 0.06
    assert flown.outcome.fallbacks == 0


def test_the_height_of_the_take_off_is_the_missions(bench):
    flown = bench.fly(settings={"takeoff_height_m": "1.5"})
    assert flown.outcome.outcome == "landed"
    ((_, takeoff),) = asked(flown, CommandId.NAV_TAKEOFF)
    assert takeoff[6] == 1.5
    state = next(r for r in flown.records("control")).values
    assert state["position_enu_m"][2] == pytest.approx(1.5, abs=0.3)


def test_guided_is_asked_for_again_when_the_boot_overwrites_it(bench):
    """While it boots it acknowledges GUIDED, and then reads the remote control's mode switch."""
    flown = bench.fly(boot_scale=1.0)
    assert flown.outcome.outcome == "landed", flown.outcome.note
    ((armed_s, _),) = asked(flown, CommandId.COMPONENT_ARM_DISARM)
    assert modes_asked(flown)[:1] == [GUIDED]
    assert 37.0 < armed_s < 50.0
    # A person is told what is waited for.
    assert any("waiting for: a position of its estimator" in t for _, _, t in flown.seen.messages)


def test_who_keeps_choosing_another_mode_is_not_fought(bench):
    """The mode switch of a remote control is turned on the ground, again and again."""

    def switch():
        if bench.wire.armed and not bench.wire.armed[-1][1]:
            bench.wire.change_mode("stabilize")

    for k in range(400):
        bench.after("ready", 0.1 + 0.5 * k, switch)
    bench.wire.from_shim = edit(
        MessageId.SYS_STATUS, struct.Struct("<3I"), lambda p, e, h: (p, e, h & ~0x1000_0000)
    )
    flown = bench.fly(settings={"timeouts.ready_s": "200"})
    assert_refused(flown, "Somebody else chose mode stabilize before arming, in place of guided")
    # What came at once may have been the boot; the next change is somebody's.
    assert modes_asked(flown) == [GUIDED, GUIDED]
    assert flown.wire.modes[-1][1] == "stabilize"


def test_an_ardupilot_that_booted_long_ago_is_flown(bench):
    """Nothing streams, and nobody says again what it said when it booted."""
    bench.after("connect", 0.0, lambda: bench.wire.cut(20.0))
    flown = bench.fly(settings={"timeouts.connect_s": "30"})
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.began("arm") - 20.0 < 8.0


def test_an_armed_ardupilot_is_refused(bench):
    bench.wire.from_shim = edit(
        MessageId.HEARTBEAT,
        _HEARTBEAT,
        lambda mode, kind, kind2, base, *rest: (mode, kind, kind2, base | 0x80, *rest),
    )
    flown = bench.fly()
    assert_refused(flown, "The vehicle is armed already (mode")
    assert flown.wire.commands == []


def test_another_autopilot_than_the_wanted_one_is_refused(bench):
    flown = bench.fly(options={"autopilot": "px4"})
    assert_refused(flown, "has MAV_AUTOPILOT 3, which is ArduPilot; px4 has 12")
    assert flown.wire.commands == []


def test_arming_that_is_denied_comes_with_ardupilots_own_words(bench):
    """It denies first, and says why after that."""

    def deny(packet):
        if packet.message_id == MessageId.COMMAND_LONG:
            *_, command, _, _, _ = packet.fields(struct.Struct("<7fHBBB"))
            if command == CommandId.COMPONENT_ARM_DISARM:
                answer = Outgoing(MessageId.COMMAND_ACK, _ACK.pack(400, 4, 0, 0, 1, 191))
                bench.wire.send_to_companion(answer)
                asyncio.get_running_loop().call_later(0.1, explain)
                return b""
        return packet.raw

    def explain():
        for text in status_texts(Severity.CRITICAL, "Arm: Compass not calibrated"):
            bench.wire.send_to_companion(text)

    bench.wire.to_shim = deny
    flown = bench.fly()
    assert_refused(flown, "Arming was denied: the autopilot refused COMPONENT_ARM_DISARM: failed")
    assert "It said: " in flown.outcome.note
    assert "Arm: Compass not calibrated" in flown.outcome.note


@pytest.mark.parametrize("mode", ["loiter", "land", "stabilize", "rtl"])
def test_a_mode_that_somebody_else_chose_ends_the_stream(bench, mode):
    bench.after("track", 0.6, lambda: bench.wire.change_mode(mode))
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    changed = flown.began("track") + 0.6
    (said,) = flown.told("handed over: somebody else changed the mode to " + mode)
    assert said - changed < 1.2
    assert flown.wire.setpoints_after(said) == []
    # Nothing is sent that would take the vehicle back: no BRAKE either.
    assert [c for t, c, _ in flown.wire.commands if t > changed + 0.1] == []


def assert_braked(flown, since_s):
    """BRAKE was commanded and confirmed, and the stream held until then and no longer."""
    assert modes_asked(flown, since_s)[0] == BRAKE
    assert LAND not in modes_asked(flown, since_s)
    asked_s = next(t for t, main, _ in flown.wire.mode_requests() if main == BRAKE)
    assert asked_s - since_s < 0.1
    braked = next(t for t, name in flown.wire.modes if name == "brake")
    assert braked - since_s < 1.2
    held = flown.wire.setpoints_after(asked_s)
    assert all(s.tilt_deg < 0.01 for s in held)
    assert flown.wire.setpoints_after(braked + 0.1) == []
    assert len(flown.told("handed over: the autopilot is in mode brake")) == 1


def test_an_abort_brakes(bench):
    bench.after("track", 1.0, lambda: bench.inbox.put(PilotCommand.ABORT))
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    assert "aborted by command" in flown.outcome.note
    assert_braked(flown, flown.began("track") + 1.0)
    assert flown.wire.modes[-1][1] == "brake"


def test_an_abort_during_the_take_off_brakes_too(bench):
    """ArduPilot takes off in GUIDED, so nothing else would end what the companion began."""
    bench.after("take off", 4.5, lambda: bench.inbox.put(PilotCommand.ABORT))
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    assert modes_asked(flown, flown.began("take off"))[0] == BRAKE
    assert flown.wire.setpoints == []


def test_the_ladders_end_brakes(bench):
    """The state is lost; heartbeats still come."""
    lost = (MessageId.LOCAL_POSITION_NED,)
    bench.after("track", 1.0, lambda: bench.wire.cut(None, lost))
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    (said,) = flown.told("handing over: no usable state")
    assert said - flown.began("track") - 1.0 < 1.1
    assert_braked(flown, said)


def test_a_failure_of_the_companion_brakes(bench, monkeypatch):
    from companion.flight.setpoints.control_loop import ControlLoop

    def break_it():
        def failing(self, state, delay_s):
            raise ValueError("made up")

        monkeypatch.setattr(ControlLoop, "on_sample", failing)

    bench.after("track", 1.0, break_it)
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    (said,) = flown.told("handing over: the companion failed (ValueError: made up)")
    assert_braked(flown, said)


def test_a_helper_that_dies_brakes_before_the_end(bench, monkeypatch):
    """Without its housekeeping the companion is deaf; the vehicle must not be left in GUIDED."""
    from companion.flight.vehicle.connection import Connection

    def break_it():
        def failing(self, now_s):
            raise KeyError("made up")

        monkeypatch.setattr(Connection, "_keep_up", failing)

    bench.after("track", 1.0, break_it)
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    assert "KeyError" in flown.outcome.note
    assert_braked(flown, flown.began("track") + 1.0)


@pytest.mark.parametrize("phase", ["take off", "track", "land"])
def test_a_failure_of_the_flight_itself_brakes_before_the_end(bench, monkeypatch, phase):
    """Whatever raises in it: the companion ends, and the vehicle must not be left in GUIDED.

    Where the landing has been confirmed it goes on.
    """

    def failing():
        raise KeyError("made up")

    def break_it():
        monkeypatch.setattr(bench.inbox, "take", failing)

    bench.after(phase, 4.0 if phase == "take off" else 1.0, break_it)
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    assert flown.outcome.note.startswith("The companion failed (KeyError: 'made up')")
    begun = flown.began(phase) + (4.0 if phase == "take off" else 1.0)
    if phase == "land":
        assert modes_asked(flown, begun) == []
        assert flown.wire.modes[-1][1] == "land"
        return
    assert modes_asked(flown, begun) == [BRAKE]
    assert flown.wire.modes[-1][1] == "brake"
    assert flown.wire.setpoints_after(begun + 1.2) == []
    assert all(s.tilt_deg < 0.01 for s in flown.wire.setpoints_after(begun + 0.1))


def test_after_a_stand_still_of_its_own_the_companion_brakes(bench):
    def stall():
        asyncio.get_running_loop().stall(0.7)

    bench.after("track", 1.0, stall)
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    (said,) = flown.told("handing over: the companion itself stood still for 0.7 s")
    assert_braked(flown, said)


def refuse_mode(bench, mode):
    """A tamper: the autopilot refuses one mode."""

    def refuse(packet):
        if packet.message_id == MessageId.COMMAND_LONG:
            *parameters, command, _, _, _ = packet.fields(struct.Struct("<7fHBBB"))
            if command == CommandId.DO_SET_MODE and parameters[1] == mode:
                payload = _ACK.pack(176, 4, 0, 0, 1, 191)
                bench.wire.send_to_companion(Outgoing(MessageId.COMMAND_ACK, payload))
                return b""
        return packet.raw

    return refuse


def test_a_landing_that_is_refused_becomes_a_brake(bench):
    """It must not be left in GUIDED, without a stream, when the companion gives up."""
    bench.after("land", 0.0, lambda: setattr(bench.wire, "to_shim", refuse_mode(bench, LAND)))
    flown = bench.fly(settings=WAIT)
    assert flown.outcome.outcome == "aborted"
    begun = flown.began("land")
    assert modes_asked(flown, begun) == [LAND, BRAKE]
    assert flown.wire.modes[-1][1] == "brake"
    assert all(s.tilt_deg < 0.01 for s in flown.wire.setpoints_after(begun + 0.1))


def test_a_brake_that_is_refused_becomes_a_landing(bench):
    """Without a position ArduPilot refuses BRAKE."""

    def abort():
        bench.wire.to_shim = refuse_mode(bench, BRAKE)
        bench.inbox.put(PilotCommand.ABORT)

    bench.after("track", 1.0, abort)
    flown = bench.fly(settings={"timeouts.handed_over_s": "40"})
    begun = flown.began("track") + 1.0
    assert modes_asked(flown, begun)[:2] == [BRAKE, LAND]
    assert len(flown.told("the autopilot refused to change to mode brake")) == 1
    assert len(flown.told("handed over: the autopilot is in mode land")) == 1
    assert flown.wire.armed[-1][1] is False


def test_a_brake_that_nobody_confirms_is_asked_for_again_and_said(bench):
    """The way back is lost: the vehicle may have obeyed long ago."""

    def abort():
        bench.wire.cut(None)
        bench.inbox.put(PilotCommand.ABORT)

    bench.after("track", 1.0, abort)
    flown = bench.fly(settings={"timeouts.link_lost_s": "8"} | WAIT)
    begun = flown.began("track") + 1.0
    assert set(modes_asked(flown, begun)) == {BRAKE}
    assert len(modes_asked(flown, begun)) > 3
    assert len(flown.told("mode brake was commanded and not confirmed")) == 1
    last = flown.wire.setpoints[-1].time_s
    assert last - begun < 1.05


def test_resuming_after_a_hand_over_asks_for_guided_again(bench):
    bench.after("track", 1.0, lambda: bench.inbox.put(PilotCommand.ABORT))
    bench.after("handed over", 3.0, lambda: bench.inbox.put(PilotCommand.RESUME))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    begun = flown.began("handed over")
    assert modes_asked(flown, begun - 0.1) == [BRAKE, GUIDED, LAND]


class Restart:
    """What a restart of the autopilot looks like from outside, played on the wire.

    Silence for a while; then its time since boot begins anew, nothing streams, and it is in
    STABILIZE again.
    """

    SILENT_S = 6.0
    BOOTED_S = 0.7
    """Time since boot at which it is heard again."""
    STREAMS = (1, 31, 32, 83, 147, 193, 245, 436)

    def __init__(self, wire, before_s=0.0):
        self.wire = wire
        self.before_s = before_s
        """How long it had been up when the simulation began."""
        self.begun_s = math.inf

    def begin(self):
        self.begun_s = asyncio.get_running_loop().time()
        for message_id in self.STREAMS:
            self.wire.send_to_vehicle(message_interval(Target(1), message_id, None).as_long())
        self.wire.change_mode("stabilize")

    def tamper(self, packet):
        if self.begun_s < packet.time_s < self.begun_s + self.SILENT_S:
            return b""
        shift_s = self.before_s
        if packet.time_s > self.begun_s:
            shift_s = self.BOOTED_S - self.begun_s - self.SILENT_S
        if packet.message_id == MessageId.TIMESYNC:
            ours, theirs = packet.fields(struct.Struct("<qq"))
            if ours == 0:
                theirs += round(shift_s * 1e9)
            else:
                ours += round(shift_s * 1e9)
            return packet.with_payload(struct.pack("<qq", ours, theirs))
        if packet.message_id in (31, 32) and packet.component_id == AUTOPILOT:
            (time_ms,) = packet.fields(struct.Struct("<I"))
            time_ms = (time_ms + round(shift_s * 1e3)) % 2**32
            return packet.with_payload(struct.pack("<I", time_ms) + packet.payload[4:])
        return packet.raw


def test_an_autopilot_that_restarts_on_the_ground_is_waited_for(bench):
    """Everything is asked for again, and the flight is flown on the new time."""
    restart = Restart(bench.wire, before_s=100.0)
    bench.wire.from_shim = restart.tamper
    bench.after("ready", 1.5, restart.begin)
    flown = bench.fly(options={"autopilot": "ardupilot"}, boot_scale=0.3)
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    (told,) = flown.told("the autopilot has restarted")
    assert told - restart.begun_s - restart.SILENT_S < 1.5
    after = [t for t, _ in asked(flown, CommandId.SET_MESSAGE_INTERVAL) if t > restart.begun_s]
    assert len(after) >= 5
    assert modes_asked(flown, told)[0] == GUIDED
    # dt and the reference are of the new clock.
    assert flown.outcome.scored_s[0] < flown.began("track") - restart.begun_s + 0.2


def test_streams_that_somebody_stopped_before_the_flight_are_asked_for_again(bench):
    """As if it had restarted so early that its time since boot told nothing."""
    bench.after("ready", 1.5, Restart(bench.wire).begin)
    flown = bench.fly(boot_scale=0.3)
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert len(flown.told("SYS_STATUS has stopped; asking for the streams again")) == 1


@pytest.mark.parametrize("silent_s", [0.2, 2.0])
def test_an_autopilot_that_restarts_in_flight_ends_it(bench, silent_s):
    """Whether it was handed over first, or had no time for that: it is said what happened."""
    restart = Restart(bench.wire, before_s=100.0)
    restart.SILENT_S = silent_s
    bench.wire.from_shim = restart.tamper
    bench.after("track", 1.0, restart.begin)
    flown = bench.fly(settings=WAIT | {"supervisor.hand_over_after_s": "1.0"})
    assert flown.outcome.outcome == "aborted"
    assert not flown.outcome.completed
    assert "he autopilot restarted in flight" in flown.outcome.note
    assert flown.wire.setpoints_after(restart.begun_s + silent_s + 1.0) == []


def test_a_boot_time_that_wraps_in_flight_goes_on(bench):
    """`time_boot_ms` has 32 bits: after 49.7 days it begins anew, and TIMESYNC's does not."""
    up_s = 2**32 / 1e3 - 17.0
    restart = Restart(bench.wire, before_s=up_s)
    bench.wire.from_shim = restart.tamper
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    assert flown.outcome.fallbacks == 0
    start_s, end_s = flown.outcome.scored_s
    assert start_s < 2**32 / 1e3 < end_s
    assert flown.told("the autopilot has restarted") == []
    assert start_s > up_s


def test_our_own_heartbeat_says_the_truth(bench):
    bench.after("track", 1.5, lambda: bench.wire.cut(0.4, (MessageId.LOCAL_POSITION_NED,)))
    bench.after("return", 0.1, lambda: bench.inbox.put(PilotCommand.ABORT))
    bench.after("handed over", 4.0, lambda: bench.inbox.put(PilotCommand.LAND))
    flown = bench.fly()
    said = flown.wire.health
    standby, active, critical, emergency = 3, 4, 5, 6
    engaged, handed = flown.began("engage"), flown.began("handed over")
    cut = flown.began("track") + 1.5
    assert {state for t, state in said if t < engaged} == {standby}
    assert {state for t, state in said if engaged < t < cut} == {active}
    assert critical in {state for t, state in said if cut < t < cut + 2.0}
    assert {state for t, state in said if cut + 2.5 < t < handed} <= {active}
    assert {state for t, state in said if handed < t < handed + 4.0} == {emergency}
    assert said[-1][1] == standby


def test_a_study_in_the_air_begins_and_ends_in_guided(bench):
    flown = bench.fly(airborne=True)
    assert flown.outcome.outcome == "tracked", flown.outcome.note
    assert flown.outcome.completed
    assert flown.wire.mode_requests() == []
    assert [name for _, name in flown.wire.modes] == ["guided"]


def test_an_error_in_a_stage_of_the_flight_brakes(bench, monkeypatch):
    """A mistake of the companion's own, not in the control loop but in what directs it."""
    from companion.flight.stages import phases

    async def failing(flight, timeline):
        await flight.connection.waiting.pause(1.0)
        raise ZeroDivisionError("made up")

    monkeypatch.setattr(phases, "track", failing)
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    assert "The companion failed (ZeroDivisionError" in flown.outcome.note
    assert flown.wire.modes[-1][1] == "brake"
    assert modes_asked(flown)[-1] == BRAKE


def test_body_rates_fly_it_too(bench):
    flown = bench.fly(options={"setpoint": "rates"}, check=False)
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    assert {s.mask for s in flown.wire.setpoints} == {128}


def hover_thrusts(flown):
    return {r.values["hover_thrust"] for r in flown.records("control")}


def test_the_thrust_field_is_flown_as_the_autopilot_takes_it(bench):
    """GUID_OPTIONS 8: a throttle, for which a hover thrust is estimated; else a climb rate."""
    flown = bench.fly(parameters={"GUID_OPTIONS": 8.0})
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    assert hover_thrusts(flown) != {None}


def test_by_default_the_thrust_field_is_flown_as_a_climb_rate(bench):
    assert hover_thrusts(bench.fly()) == {None}


@pytest.mark.parametrize("name", [b"GUID_OPTIONS", b"WPNAV_SPEED_UP"])
def test_a_thrust_field_of_unknown_meaning_is_refused(bench, name):
    bench.wire.from_shim = lambda p: (
        b"" if p.message_id == MessageId.PARAM_VALUE and name in p.payload else p.raw
    )
    assert_refused(bench.fly(), name.decode())


def stall_once(bench, duration_s):
    bench.after("track", 1.0, lambda: asyncio.get_running_loop().stall(duration_s))


def test_the_longest_pause_of_ours_is_half_of_the_autopilots_own_time_out(bench):
    """GUID_TIMEOUT 0.4 s: 0.3 s of standing still may have been too long, with 3 s it is not."""
    stall_once(bench, 0.3)
    flown = bench.fly(settings=WAIT, parameters={"GUID_TIMEOUT": 0.4})
    assert flown.outcome.outcome == "aborted"
    (said,) = flown.told("handing over: the companion itself stood still for 0.3 s")
    assert_braked(flown, said)


def test_a_short_pause_is_flown_over_where_the_autopilot_waits_longer(bench):
    stall_once(bench, 0.3)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note


def test_a_yaw_that_is_realigned_in_flight_does_not_upset_it(bench):
    """The estimator turns by 2.4 degrees in one sample, as a real one does after take-off."""
    turned = quaternion_from_euler(0.0, 0.0, math.radians(2.4))
    layout = struct.Struct("<I4f")

    def realign(packet):
        if packet.message_id != MessageId.ATTITUDE_QUATERNION or packet.component_id != AUTOPILOT:
            return packet.raw
        time_ms, *q = packet.fields(layout)
        q = quaternion_multiply(turned, tuple(q))
        return packet.with_payload(layout.pack(time_ms, *q) + packet.payload[layout.size :])

    bench.after("track", 1.0, lambda: setattr(bench.wire, "from_shim", realign))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    assert flown.outcome.fallbacks == 0
    jumped = flown.began("track") + 1.0
    before = [s for s in flown.wire.setpoints if jumped - 0.05 < s.time_s < jumped]
    after = [s for s in flown.wire.setpoints if jumped < s.time_s < jumped + 0.05]
    assert abs(after[-1].tilt_deg - before[-1].tilt_deg) < 3.0


@pytest.mark.parametrize("speed", [0.5, 3.0])
def test_other_speeds_than_1_change_nothing_but_the_clocks(bench, speed):
    """The loop runs on the autopilot's time: dt, the reference and the time-outs of the flight."""
    flown = bench.fly(speed=speed)
    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert flown.outcome.completed
    start_s, end_s = flown.outcome.scored_s
    assert end_s - start_s == pytest.approx(4.0, abs=0.1)
    control = [r.values["autopilot_time_s"] for r in flown.records("control")]
    steps = [b - a for a, b in pairwise(control)]
    assert sorted(steps)[len(steps) // 2] == pytest.approx(0.010, abs=0.0025)


def test_a_ground_station_whose_heartbeat_the_autopilot_forwards_is_not_the_vehicle(bench):
    """It is first on the link, and of the same system id."""
    heartbeat = _HEARTBEAT.pack(0, 6, 8, 0x80, 4, 3)

    def speak():
        for component in (190, 1):
            bench.wire.send_to_companion(Outgoing(MessageId.HEARTBEAT, heartbeat), component)

    for delay_s in (0.0, 0.5, 1.5):
        bench.after("connect", delay_s, speak)
    bench.after("track", 0.5, speak)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed", flown.outcome.note


def test_another_vehicle_on_the_link_is_not_flown_when_a_system_id_is_wanted(bench):
    flown = bench.fly(settings={"link.system_id": "7", "timeouts.connect_s": "3"})
    assert_refused(flown, "No HEARTBEAT of an autopilot came")
