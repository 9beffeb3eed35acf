"""Which of the stacks flies: the configured one, what the monitor leads to, what was asked for.

Pure but for its memory: every decision follows from the ticks that it is given.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from companion.config.monitor_models import L1_OFF, SwitchConfig
from companion.control import desired_slew, handover, monitor
from companion.control.desired_slew import DesiredSlew
from companion.control.frameworks import Command, Reference, StackRecord, Tick
from companion.control.handover import Fade
from companion.control.interfaces import AdaptationMean
from companion.control.monitor import NO_GAUGES, Gauges, MonitorLimits, MonitorMemory, Seen
from companion.flight.stacks import Ladder, NamedStack, Stacks
from companion.frames import Vector3
from companion.vehicle_state import VehicleState

Cause = Literal["switch", "monitor", "failure"]
_REPEATED_S = 10.0
"""The same warning is not told again within this."""


class UnsoundCommandError(Exception):
    """A controller's command may not be sent."""

    def __init__(self, record: StackRecord) -> None:
        super().__init__("the controller's command is not finite or out of bounds")
        self.record = record


@dataclass(frozen=True, slots=True)
class Change:
    """A hand-over, or why there is none; for the log and for a person."""

    time_s: float
    """Autopilot's."""
    track_s: float
    """Since the trajectory began."""
    controller: str
    """That flies from now on."""
    cause: Cause
    text: str
    handed_over: bool = True
    """False: the same controller flies on."""


# Watch and _Flown are made at every tick, and frozen
# they take several times as long to make: change none.
@dataclass(slots=True)
class Watch:
    """What a tick's record says of the controller that flew it."""

    controller: str
    monitor: str
    """Level: nominal, reduced, robust; "failed" once the monitor itself has; empty: none."""
    gauges: Gauges = NO_GAUGES
    slew_bound_rad_s: float = math.nan
    changes: tuple[Change, ...] = ()


@dataclass(slots=True)
class _Flown:
    """A tick that a stack has flown, or begun with."""

    memory: Any
    state: VehicleState
    command: Command | None
    """None at the tick at which it began."""
    record: StackRecord | None


@dataclass(frozen=True, slots=True)
class _Plan:
    """Who is to fly."""

    ladder: Ladder
    level: int
    held: NamedStack | None
    """In place of the ladder's, with its adaptation switched off."""
    cause: Cause
    why: str
    same_laws: bool = False
    """The same stack with its adaptation switched on or off: its memory goes on."""
    stack: NamedStack = field(init=False)
    """That flies by this plan."""

    def __post_init__(self) -> None:
        """Look up the stack, which every tick asks for several times."""
        stack = self.ladder[self.level] if self.held is None else self.held
        object.__setattr__(self, "stack", stack)


class StackRunner:
    """Runs the stack whose turn it is, and hands over between them without a bump."""

    def __init__(self, stacks: Stacks) -> None:
        self._made = self._stacks = stacks
        self._monitor = MonitorMemory()
        self._monitor_works = True
        self._thrust_memory = stacks.ladder[0].stack.thrust.start(0.0)
        self._begin()

    def engage(self, anchor_enu_m: Vector3) -> None:
        """Begin with the configured stack, its geofence about a point (ENU m)."""
        self._stacks = self._made.about(anchor_enu_m)
        self._begin()

    def _begin(self) -> None:
        stacks = self._stacks
        self._plan = _Plan(stacks.ladder, 0, None, "switch", "")
        self._switches: tuple[SwitchConfig, ...] = stacks.switches
        self._wanted: _Plan | None = None
        self._mean: AdaptationMean | None = None
        self._slew = DesiredSlew()
        self._monitor = monitor.at_level(self._monitor, 0)
        self._warned_s = -math.inf
        self.forget()

    def forget(self) -> None:
        """What the laws remember is not true any more: start anew at the next tick."""
        self._flown: _Flown | None = None
        self._fade: Fade | None = None

    @property
    def present(self) -> NamedStack:
        """The stack that flies."""
        return self._plan.stack

    def hold(self, climb_rate_m_s: float, cosine: float) -> float:
        """The thrust field that ends a climb rate, by the present stack's law."""
        return self.present.stack.thrust.hold(self._thrust_memory, climb_rate_m_s, cosine)

    def flown_s(self) -> float | None:
        """Time of the last tick; None if the next one starts anew."""
        return None if self._flown is None else self._flown.state.time_s

    def watch(self, changes: tuple[Change, ...] = ()) -> Watch:
        """Who flies, for a tick at which nobody watched."""
        return Watch(self.present.name, self._level_name(), changes=changes)

    def step(
        self, tick: Tick, reference: Reference
    ) -> tuple[Command | None, StackRecord | None, Watch]:
        """Fly a tick; no command at the one at which a stack begins.

        Raises:
            UnsoundCommandError: of the present stack, and there is none below it.
            Exception: whatever it raises, likewise.
        """
        changes: list[Change] = []
        before, self._flown = self._flown, None
        plan = self._due(tick, changes)
        if before is None:
            if plan is not None:
                self._take(plan, tick, changes)
            self._flown = self._started(tick, changes)
            return None, None, self.watch(tuple(changes))
        flown = None
        if plan is not None:
            flown = self._relieve(plan, before, tick, reference, changes)
        if flown is None:
            flown = self._fly(before, tick, reference, changes)
        assert flown.command is not None
        assert flown.record is not None
        # What a fade makes of a command is not the controller's doing.
        watch = self._look(before, flown.record, tick, reference, changes)
        flown = self._with_fade(flown, flown.command, flown.record)
        self._flown = flown
        self._thrust_memory = flown.memory.thrust
        return flown.command, flown.record, watch

    def _started(self, tick: Tick, changes: list[Change]) -> _Flown:
        """The present stack's begin; of one below it if it cannot."""
        while True:
            try:
                memory = self.present.stack.start(tick.state, self._thrust_memory)
            except Exception as error:
                below = self._below(self._plan, _failure(error))
                if below is None:
                    raise
                self._take(below, tick, changes)
            else:
                return _Flown(memory, tick.state, None, None)

    def _below(self, plan: _Plan, why: str) -> _Plan | None:
        """What is flown when a plan's stack has failed."""
        if plan.level + 1 >= len(plan.ladder):
            return None
        return _Plan(plan.ladder, plan.level + 1, None, "failure", why)

    def _fly(
        self, before: _Flown, tick: Tick, reference: Reference, changes: list[Change]
    ) -> _Flown:
        """A tick of the present stack; of one below it if it fails."""
        try:
            return _stepped(self.present, before.memory, tick, reference)
        except Exception as error:
            below = self._below(self._plan, _failure(error))
            while below is not None:
                flown = self._relieve(below, before, tick, reference, changes)
                if flown is not None:
                    return flown
                below = self._below(below, _failure(error))
            raise

    def _due(self, tick: Tick, changes: list[Change]) -> _Plan | None:
        """Who is to fly from this tick on; None: who flew before."""
        wanted, self._wanted = self._wanted, None
        while self._switches and tick.track_s >= self._switches[0].at_s - 1e-6:
            switch, self._switches = self._switches[0], self._switches[1:]
            wanted = self._asked_for(switch, wanted or self._plan, tick, changes) or wanted
        return wanted

    def _asked_for(
        self, switch: SwitchConfig, plan: _Plan, tick: Tick, changes: list[Change]
    ) -> _Plan | None:
        why = "as asked for"
        if switch.controller is not None:
            if plan.held is None and plan.level == 0 and plan.stack.name == switch.controller:
                text = f"hand-over to {switch.controller}: nothing is to be done"
                self._note(tick, changes, "switch", text)
                return None
            ladder = self._stacks.others[switch.controller]
            return _Plan(ladder, 0, None, "switch", why)
        if switch.to != L1_OFF:
            if plan.held is None:
                self._note(tick, changes, "switch", f"{switch.to}: it is on already")
                return None
            return _Plan(plan.ladder, plan.level, None, "switch", why, same_laws=True)
        rung = plan.ladder[plan.level]
        stack = None
        if plan.held is None and self._mean is not None and rung is self.present:
            stack = rung.stack.without_adaptation(self._mean)
        if stack is None:
            text = f"{switch.to}: {rung.name} has no adaptation that could be switched off now"
            self._note(tick, changes, "switch", text)
            return None
        held = replace(rung, name=f"{rung.name}, L1 off", stack=stack)
        return _Plan(plan.ladder, plan.level, held, "switch", why, same_laws=True)

    def _relieve(
        self,
        plan: _Plan,
        before: _Flown,
        tick: Tick,
        reference: Reference,
        changes: list[Change],
    ) -> _Flown | None:
        """Hand over; None if who should take over cannot: then the present one flies on."""
        old, new = self.present, plan.stack
        applied = None
        if before.command is not None and before.record is not None:
            same_kind = type(old.stack) is type(new.stack)
            applied = handover.applied_u(before.command, before.record, same_kind=same_kind)
        try:
            memory = before.memory
            if not plan.same_laws:
                memory = new.stack.start(before.state, self._thrust_memory, applied)
            flown = _stepped(new, memory, tick, reference)
        except Exception as error:
            text = f"{new.name} cannot take over ({type(error).__name__}: {error})"
            self._note(tick, changes, plan.cause, text)
            if plan.cause == "monitor":
                self._settle(self._plan.level)
            return None
        self._take(plan, tick, changes)
        if before.command is not None:
            asked = plan.cause == "switch"
            length_s = handover.FADE_S if asked else handover.QUICK_FADE_S
            self._fade = handover.fade_from(before.command, tick.state.time_s, length_s)
        return flown

    def _take(self, plan: _Plan, tick: Tick, changes: list[Change]) -> None:
        """From now on the plan's stack flies."""
        old, new = self.present, plan.stack
        if plan.cause == "failure":
            self._settle(plan.level)
        if plan.cause == "switch":
            self._monitor = monitor.at_level(self._monitor, plan.level)
            self._mean = self._mean if plan.ladder is self._plan.ladder else None
        self._plan = plan
        text = f"{old.name} → {new.name}: {plan.why}"
        changes.append(Change(tick.state.time_s, tick.track_s, new.name, plan.cause, text))

    def _settle(self, level: int) -> None:
        """Stay at a level or below it: what is above has failed."""
        if self._stacks.monitor is not None:
            self._monitor = monitor.settled(self._stacks.monitor, self._monitor, level)

    def _with_fade(self, flown: _Flown, command: Command, record: StackRecord) -> _Flown:
        fade = self._fade
        if fade is None:
            return flown
        time_s = flown.state.time_s
        if fade.over(time_s):
            self._fade = None
            return flown
        command, roll, pitch = handover.faded(fade, command, time_s)
        record = replace(record, roll_rad=roll, pitch_rad=pitch)
        return replace(flown, command=command, record=record)

    def _look(
        self,
        before: _Flown,
        record: StackRecord,
        tick: Tick,
        reference: Reference,
        changes: list[Change],
    ) -> Watch:
        """The monitor's look at a tick; whatever fails in it, the flight goes on as it is."""
        limits = self._stacks.monitor
        if limits is None or not self._monitor_works:
            return self.watch(tuple(changes))
        try:
            return self._monitored(limits, before, record, tick, reference, changes)
        except Exception as error:
            self._monitor_works = False
            self._wanted = None
            text = f"the monitor failed ({type(error).__name__}: {error}); it watches no more"
            self._note(tick, changes, "monitor", text)
            return self.watch(tuple(changes))

    def _monitored(
        self,
        limits: MonitorLimits,
        before: _Flown,
        record: StackRecord,
        tick: Tick,
        reference: Reference,
        changes: list[Change],
    ) -> Watch:
        stacks, plan, state = self._stacks, self._plan, tick.state
        dt_s = state.time_s - before.state.time_s
        if plan.held is None:
            self._mean = handover.mean_step(self._mean, record, state.velocity_enu_m_s, dt_s)
        self._slew = desired_slew.step(self._slew, reference, state.time_s)
        seen = Seen(
            state.time_s,
            record.inner,
            record.roll_rad,
            record.pitch_rad,
            tick.loop_delay_s,
            self._slew.rate_rad_s,
        )
        lowest = len(plan.ladder) - 1 if stacks.acts else plan.level
        self._monitor, verdict = monitor.step(limits, self._monitor, seen, lowest)
        if verdict.level != plan.level:
            why = f"the monitor saw {' and '.join(verdict.reasons)}"
            self._wanted = _Plan(plan.ladder, verdict.level, None, "monitor", why)
        elif verdict.alarm and state.time_s - self._warned_s > _REPEATED_S:
            self._warned_s = state.time_s
            self._note(tick, changes, "monitor", f"the monitor saw {' and '.join(verdict.reasons)}")
        bound = monitor.slew_bound_rad_s(limits, self._slew.rate_rad_s)
        name = self.present.name
        return Watch(name, self._level_name(), verdict.gauges, bound, tuple(changes))

    def _level_name(self) -> str:
        if self._stacks.monitor is None:
            return ""
        return self.present.level if self._monitor_works else "failed"

    def _note(self, tick: Tick, changes: list[Change], cause: Cause, text: str) -> None:
        """Tell something for which nobody hands over."""
        name = self.present.name
        text = f"{text}; {name} flies on"
        changes.append(Change(tick.state.time_s, tick.track_s, name, cause, text, False))


def _failure(error: Exception) -> str:
    """What is said of a controller that has failed."""
    if isinstance(error, UnsoundCommandError):
        return str(error)
    return f"the controller failed ({type(error).__name__}: {error})"


def _stepped(who: NamedStack, memory: Any, tick: Tick, reference: Reference) -> _Flown:  # noqa: ANN401
    """A tick of a stack.

    Raises:
        UnsoundCommandError: its command may not be sent.
    """
    advanced, command, record = who.stack.step(memory, tick, reference)
    finite = math.isfinite(sum(command.attitude_flu_to_enu))
    if not finite or not 0.0 <= command.thrust <= 1.0:  # which a thrust that is NaN is not
        raise UnsoundCommandError(record)
    return _Flown(advanced, tick.state, command, record)
