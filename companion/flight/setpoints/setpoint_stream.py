"""The stream of setpoints, with its deadman.

A setpoint leaves when a fresh sample comes, and only then; a timer covers samples that do not
come.  Once the stream has stopped, or somebody else has changed the mode, it stays stopped: PX4
would take a resumed stream for consent.
"""

import asyncio
import math
import time
from collections.abc import Callable, Mapping
from typing import Any

from companion.control.monitor import NO_GAUGES
from companion.control.mpc import MpcRecord
from companion.flight.loop_time import loop_time
from companion.flight.observer import TickView
from companion.flight.records import (
    INPUT,
    control_record,
    feedback_record,
    plan_record,
    silence_record,
)
from companion.flight.setpoints import inputs
from companion.flight.setpoints.announcer import Announcer, Condition
from companion.flight.setpoints.control_loop import ControlLoop, Output
from companion.flight.setpoints.stack_runner import Change, Watch
from companion.flight.setpoints.supervisor import Rung
from companion.flight.setpoints.timeline import Timeline
from companion.flight.setpoints.timing import Punctuality
from companion.flight.stages.handing_over import HandingOver
from companion.flight.vehicle.connection import Connection
from companion.flight.voice import RecordLog, Voice
from companion.frames import Quaternion, Vector3, tilt_cosine
from companion.mavlink.setpoints import (
    AttitudeSetpoint,
    BodyRateSetpoint,
    InvalidSetpointError,
    Setpoint,
    setpoint_message,
)
from companion.vehicle_state import VehicleState

_WATCH_S = 0.02
_LATE_S = 0.02
_LONGEST_DELAY_S = 1.0
"""Whatever is measured, this is what the supervisor is told at most: far more than it bears."""
_CLOCK_ERROR_S = 0.5
"""A sample from further ahead than this is no error of our estimate: its clock has jumped."""
_EXACT_PER_S = 1.0e6
"""What the control loop is given is rounded to whole microseconds: the log keeps that exactly."""
_MOST_CHANGES = 200
"""Kept for the result; the log has all of them."""
LONGEST_PAUSE_S = 0.5
"""By the autopilot's clock; half of the second after which PX4's failsafe acts by default."""


class SetpointStream:
    """Runs the control loop at each sample and sends what it decides."""

    def __init__(
        self,
        connection: Connection,
        control: ControlLoop,
        log: RecordLog,
        voice: Voice,
        punctuality: Punctuality,
    ) -> None:
        self.control = control
        self.punctuality = punctuality
        self.running = False
        self.stopped_because = ""
        """Why the stream stopped by itself; empty if it did not."""
        self.longest_pause_s = LONGEST_PAUSE_S
        """A stream that has paused for longer is not taken up again, s of the autopilot's clock."""
        self.handing_over = HandingOver(connection, voice)
        self.fallbacks = 0
        """Ticks at which something less than the controller's optimum was sent."""
        self.plans = 0
        self.plans_at_r_max = 0
        """Plans at which the bound on the second difference of r was active."""
        self.changes: list[Change] = []
        """The first hand-overs between controllers, and what the monitor warned of."""
        self._worst = NO_GAUGES
        self._connection = connection
        self._log = log
        self._voice = voice
        self._announcer = Announcer()
        self._fresh_s = -math.inf
        """Loop's time at which the newest sample came that could be flown on."""
        self._unusable = ""
        """What was wrong with the samples since."""
        self._record_trouble_told = False
        self._ticking = False
        self._after_tick: list[tuple[str, Mapping[str, Any]]] = []
        """Inputs that came up within a tick: they are recorded behind it."""
        self._left_told = ""
        self._sent_s: float | None = None
        """When the last setpoint went out; None if none has since the start."""
        self._time = loop_time
        """The loop's clock; from the start on without a look for the loop."""
        connection.samples.on_sample = self._on_state
        connection.samples.frozen_after_s = control.state_age_limit_s

    @property
    def flows(self) -> bool:
        """True once a setpoint has gone out since the start."""
        return self._sent_s is not None

    @property
    def monitor_worst(self) -> dict[str, float] | None:
        """The largest of each of the monitor's gauges; None if none had anything to say."""
        known = {name: value for name, value in self._worst._asdict().items() if value >= 0.0}
        return known or None

    def start(self, *, idle: bool = False) -> None:
        """Begin to stream, holding; a clean ladder.

        Args:
            idle: with no thrust, for a vehicle that stands and shall go on standing.
        """
        self.handing_over.cancel()
        self.control.release()
        self.control.idle = idle
        self._announcer.clear()
        self._time = asyncio.get_running_loop().time
        self._fresh_s = self._time()
        self._unusable = ""
        self._sent_s = None
        self.stopped_because = ""
        self.running = True
        source = self._connection.samples.source.name
        self.note(inputs.START, {"idle": idle, "source": source})
        self._connection.health.active()

    def engage(self, timeline: Timeline, yaw_rad: float, anchor_enu_m: Vector3) -> None:
        """Let the controller take over; arguments as of `ControlLoop.engage`."""
        self.control.engage(timeline, yaw_rad, anchor_enu_m)
        self.note(inputs.ENGAGE, inputs.engage_values(timeline, yaw_rad, anchor_enu_m))

    def note(self, kind: str, values: Mapping[str, Any]) -> None:
        """Record what the control loop is told besides samples, in its place among the ticks."""
        if self._ticking:
            self._after_tick.append((kind, values))
            return
        now_s = self._time()
        self._keep(INPUT.topic, now_s, lambda: {"kind": kind, "values": values})

    def hand_over(self, reason: str, *, hold: bool = True) -> None:
        """Give the vehicle to the autopilot in its own way, and stop.

        If nothing streams but the vehicle is in the mode of setpoints all the same (ArduPilot
        takes off in it), that mode is ended, too.

        Args:
            reason: why.
            hold: hold the vehicle level until the autopilot's mode is confirmed.
        """
        if self.running:
            level = self._level() if hold else None
            self.stop(reason)
        elif self.handing_over.possible:
            level = None
            self.stopped_because = reason
        else:
            return
        self._connection.health.emergency()
        if level is not None:
            held = (level.attitude_flu_to_enu, level.thrust)
            self.note(inputs.HOLD, inputs.hold_values(held))
        self.handing_over.begin(level)

    def give_up(self, reason: str, *, hold: bool = True) -> None:
        """Hand over because of something that is wrong, and tell it; nothing if nothing flows.

        Args:
            reason: what is wrong.
            hold: hold the vehicle level until the autopilot's mode is confirmed.
        """
        if not hold:
            self.handing_over.hold_no_longer()
        if self.running:
            explanation = self._connection.dialect.hand_over.explanation
            self.hand_over(reason, hold=hold)
            self._voice.tell("error", f"handing over: {reason}; {explanation}")

    def stop(self, reason: str = "") -> None:
        """Stop streaming; a reason means that it was not planned."""
        if not self.running:
            return
        self.running = False
        self._connection.health.standby()
        self.punctuality.pause()
        self.stopped_because = reason
        # Nothing that waits may go on as if setpoints flowed; who stops the stream while looking
        # at what is waited for has a better reason than we have, so not from within.
        asyncio.get_running_loop().call_soon(self._connection.waiting.wake)

    async def watch(self) -> None:
        """Cover samples that do not come, until cancelled."""
        loop = asyncio.get_running_loop()
        failed: asyncio.Future[None] = loop.create_future()
        timer: asyncio.TimerHandle

        # A timer that sets itself anew costs half of a task that sleeps.
        def look(due_s: float) -> None:
            nonlocal timer
            try:
                now_s = loop.time()
                # A stall of our own is no silence: what came meanwhile is looked at first.
                if self.running and now_s - due_s < _LATE_S:
                    self._look(now_s)
            except Exception as error:
                if not failed.done():
                    failed.set_exception(error)
                return
            timer = set_timer()

        def set_timer() -> asyncio.TimerHandle:
            due_s = loop.time() + _WATCH_S
            return loop.call_at(due_s, look, due_s)

        timer = set_timer()
        try:
            await failed
        finally:
            timer.cancel()

    def _look(self, now_s: float) -> None:
        """Cover a silence, if there is one."""
        try:
            self._cover_silence(now_s)
        except Exception as error:
            self._fail(error)

    def _loop_delay_s(self, age_s: float) -> float:
        """From a sample's time until a setpoint sent now acts, by the autopilot's clock.

        The sample's age by the synchronised clock, and the setpoint's way there.
        """
        clock = self._connection.clock
        if not clock.valid:
            return 0.0
        return max(0.0, min(_LONGEST_DELAY_S, age_s + clock.way_there_s))

    def _age_s(self, state: VehicleState, now_s: float) -> float:
        clock = self._connection.clock
        return clock.autopilot_time(now_s) - state.time_s if clock.valid else 0.0

    def _cover_silence(self, now_s: float) -> None:
        connection = self._connection
        if connection.state is None:
            return
        rate = connection.clock.rate if connection.clock.valid else 1.0
        age = _exact((now_s - self._fresh_s) * rate)
        if age <= self.control.state_age_limit_s:
            return
        autopilot_s = connection.state.time_s + age
        if connection.clock.valid:
            autopilot_s = connection.clock.autopilot_time(now_s)
        autopilot_s = _exact(autopilot_s)
        why = connection.samples.rejected_because or self._unusable
        output = self.control.on_silence(autopilot_s, age, why)
        if output is None:
            return
        self._ticking = True
        try:
            sent = self._act(output, autopilot_s)
            self._keep(
                "control",
                now_s,
                lambda: silence_record(autopilot_s, now_s, age, why, output, sent),
            )
        finally:
            self._end_tick()

    def _on_state(self, state: VehicleState, received_s: float) -> None:
        if not self.running:
            return
        try:
            self._fly_on(state, received_s)
        except Exception as error:
            # asyncio would swallow it and the stream would be blind.
            self._fail(error)

    def _fly_on(self, state: VehicleState, received_s: float) -> None:
        age = self._age_s(state, received_s)
        if age < -_CLOCK_ERROR_S:
            self._unusable = f"the autopilot's clock has jumped ahead by {-age:.1f} s"
            return
        if age > self.control.state_age_limit_s:
            self._unusable = f"the newest sample is {age * 1e3:.0f} ms old by the common clock"
            return
        delay = _exact(self._loop_delay_s(age))
        started = time.perf_counter()
        output = self.control.on_sample(state, delay)
        computed_us = round((time.perf_counter() - started) * 1e6, 1)
        if output is None:
            self._unusable = f"a sample of {state.time_s:.3f} s came after a later one"
            return
        self._fresh_s = received_s
        self._unusable = ""
        self._ticking = True
        try:
            sent = self._act(output, state.time_s)
            sent_s = self._time()
            if sent:
                self.punctuality.tick(received_s, sent_s)
            timing_s = (received_s, delay, sent_s - received_s)
            self._record(state, output, timing_s, computed_us, sent)
        finally:
            self._end_tick()

    def _end_tick(self) -> None:
        """What a tick has led to is recorded behind it, as it was decided after it."""
        self._ticking = False
        if self._after_tick:
            noted, self._after_tick = self._after_tick, []
            for kind, values in noted:
                self.note(kind, values)

    def _act(self, output: Output, autopilot_s: float) -> bool:
        """Send an output and tell of a change on the ladder; True if a setpoint went out."""
        sent = False
        if self._stood_still():
            return False
        if output.attitude_flu_to_enu is not None:
            try:
                message = setpoint_message(
                    setpoint_of(output, output.attitude_flu_to_enu),
                    autopilot_s,
                    self._connection.target,
                )
            except InvalidSetpointError as error:
                # The ladder makes none of these: what made it cannot be trusted further.
                self.give_up(f"a setpoint was withheld: {error}")
                return False
            self._connection.send(message)
            self._sent_s = self._time()
            sent = True
        now_s = self._time()
        if output.remark and self._announcer.due_remark(output.remark, now_s):
            self._voice.tell("warning", output.remark)
        if output.watch is not None:
            self._tell_changes(output.watch)
        if output.stack is not None:
            self._tell_left(output.stack.left)
        if output.fallback:
            self.fallbacks += 1
        condition = Condition(output.rung, output.fallback, output.reason)
        if self._announcer.due(condition, now_s):
            hand_over = self._connection.dialect.hand_over.explanation
            self._voice.tell(condition.severity, condition.text(hand_over))
        if output.rung is Rung.HAND_OVER:
            self.hand_over(output.reason or "the ladder's end")
        elif self.running:
            self._connection.health.active(troubled=condition.depth > 0)
        return sent

    def _tell_changes(self, watch: Watch) -> None:
        """Tell who flies now, and why."""
        worst, gauges = self._worst, watch.gauges
        if not (
            gauges.y_tilde <= worst.y_tilde
            and gauges.sigma <= worst.sigma
            and gauges.slew <= worst.slew
            and gauges.delay <= worst.delay
        ):
            self._worst = worst.largest(gauges)
        for change in watch.changes:
            if len(self.changes) < _MOST_CHANGES:
                self.changes.append(change)
            if change.cause == "switch" and change.handed_over:
                self._voice.phase("switch", change.text)
            else:
                self._voice.tell("warning", change.text)

    def _tell_left(self, left: str) -> None:
        """Tell, once, that a part of an experiment is not flown, and why."""
        if left and left != self._left_told:
            self._voice.tell("warning", left)
        self._left_told = left

    def _stood_still(self) -> bool:
        """Give up if the stream has paused for so long that a failsafe may have acted unseen.

        Its report may be lost in a full receive buffer, and to stream on would be consent.
        """
        if self._sent_s is None:
            return False
        clock = self._connection.clock
        pause_s = self._time() - self._sent_s
        pause_s *= clock.rate if clock.valid else 1.0
        if pause_s <= self.longest_pause_s:
            return False
        self.give_up(f"the companion itself stood still for {pause_s:.1f} s")
        return True

    def _fail(self, error: Exception) -> None:
        self.give_up(f"the companion failed ({type(error).__name__}: {error})")

    def _level(self) -> AttitudeSetpoint | None:
        """What holds the vehicle while it is handed over; None if that cannot be made."""
        try:
            held = self.control.level()
            return None if held is None else AttitudeSetpoint(*held)
        except Exception:
            return None  # what failed may be the controller itself; the mode is what counts

    def _record(
        self,
        state: VehicleState,
        output: Output,
        timing_s: tuple[float, float, float],
        computed_us: float,
        sent: bool,
    ) -> None:
        """Keep and show what happened at a sample.

        Args:
            state: the sample.
            output: what was decided on it.
            timing_s: arrival, loop delay, latency.
            computed_us: processing time of the controller.
            sent: a setpoint left.
        """
        received_s = timing_s[0]
        timeline = self.control.timeline
        desired, phase = None, "hold"
        if timeline is not None:
            desired, phase = timeline.position_at(state.time_s), timeline.phase(state.time_s)
        self._keep(
            "control",
            received_s,
            lambda: control_record(state, output, desired, phase, timing_s, computed_us, sent),
        )
        outer = output.stack.outer if output.stack is not None else None
        if isinstance(outer, MpcRecord):
            self.plans += 1
            self.plans_at_r_max += outer.r_max_active
            self._keep("plan", received_s, lambda: plan_record(state.time_s, outer))
        elif outer is not None:
            self._keep("feedback", received_s, lambda: feedback_record(state.time_s, outer))
        if not self._voice.shows_ticks:
            return
        if timeline is None or desired is None or output.attitude_flu_to_enu is None:
            return
        error = math.dist(desired, state.position_enu_m)
        progress = (state.time_s - timeline.start_s) / timeline.end_s
        tilt = math.degrees(math.acos(min(1.0, tilt_cosine(output.attitude_flu_to_enu))))
        self._voice.tick(
            TickView(phase, min(1.0, progress), error, tilt, output.thrust, _instead(output))
        )

    def _keep(self, topic: str, time_s: float, make: Callable[[], Mapping[str, Any]]) -> None:
        """Record; a record that cannot be made or written must not end a flight."""
        try:
            self._log.record(topic, time_s, make())
        except Exception as error:
            if not self._record_trouble_told:
                self._record_trouble_told = True
                text = f"a record of '{topic}' was lost ({type(error).__name__}: {error})"
                self._voice.tell("warning", text)


def _exact(seconds: float) -> float:
    """A time as the log keeps it."""
    return round(seconds * _EXACT_PER_S) / _EXACT_PER_S


def _instead(output: Output) -> str:
    """What flies in place of what was configured; empty if that flies."""
    watch = output.watch
    below = watch is not None and watch.monitor in ("reduced", "robust")
    return output.fallback or (watch.controller if watch is not None and below else "")


def setpoint_of(output: Output, attitude: Quaternion) -> Setpoint:
    """What is sent of an output.

    Raises:
        InvalidSetpointError: the vehicle may not be given it.
    """
    if output.rate_flu_rad_s is None:
        return AttitudeSetpoint(attitude, output.thrust)
    return BodyRateSetpoint(output.rate_flu_rad_s, output.thrust)
