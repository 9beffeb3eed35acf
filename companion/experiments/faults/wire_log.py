"""A flight's packets, read for what a judge must know."""

import math
import struct
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from companion.frames import tilt_cosine
from companion.mavlink.commands import CommandId
from companion.mavlink.dialects.base import AutopilotDialect
from companion.mavlink.framing import Frame, Framer
from companion.mavlink.messages import (
    BASE_MODE_ARMED,
    COMPONENT_AUTOPILOT,
    COMPONENT_TRUTH,
    MessageId,
    Target,
)
from companion.mavlink.telemetry import Rejected, state_from_odometry
from companion.mavlink.truth_events import TruthEvent, truth_event

_SETPOINT = struct.Struct("<I4f3ffBBB")
_HEARTBEAT = struct.Struct("<IBBBBB")
_COMMAND_LONG = struct.Struct("<7fHBBB")
_COMMAND_INT = struct.Struct("<4fiifHBBBBB")
_RATES_ONLY = 128
_REQUEST_MESSAGE = 512
_ABOUT_MESSAGES = (CommandId.SET_MESSAGE_INTERVAL, _REQUEST_MESSAGE)
_OVERTAKEN_WITHIN_S = 0.3
_BEGAN_ANEW_S = 1.0
_STAMPS = {
    MessageId.ODOMETRY: (struct.Struct("<Q"), 1e-6),
    MessageId.LOCAL_POSITION_NED: (struct.Struct("<I"), 1e-3),
}
"""Of the messages that complete a state: how its time is told, and in what unit (s)."""

_LISTENED_TO = {*_STAMPS, MessageId.HEARTBEAT, MessageId.CURRENT_MODE}


@dataclass(frozen=True, slots=True)
class Setpoint:
    """One SET_ATTITUDE_TARGET that left."""

    time_s: float
    finite: bool
    tilt_rad: float
    thrust: float
    rate_rad_s: float
    state_age_s: float


@dataclass(frozen=True, slots=True)
class Commanded:
    """A command that left, as COMMAND_LONG or COMMAND_INT."""

    time_s: float
    command_id: int
    params: tuple[float, float, float]
    """The first three."""

    @property
    def moves(self) -> bool:
        """Whether it is about the vehicle's motion; else it asks for messages."""
        return self.command_id not in _ABOUT_MESSAGES

    @property
    def label(self) -> str:
        """For a person."""
        try:
            return CommandId(self.command_id).name
        except ValueError:
            return f"command {self.command_id}"


@dataclass(slots=True)
class WireLog:
    """What the packets tell; times by the companion's clock."""

    setpoints: list[Setpoint] = field(default_factory=list)
    truth_times_s: list[float] = field(default_factory=list)
    truth_stamps_s: list[float] = field(default_factory=list)
    truth_positions_enu_m: list[tuple[float, float, float]] = field(default_factory=list)
    truth_velocities_enu_m_s: list[tuple[float, float, float]] = field(default_factory=list)
    truth_tilts_rad: list[float] = field(default_factory=list)
    events: list[tuple[float, TruthEvent]] = field(default_factory=list)
    """Each once, with its first arrival."""
    commands: list[Commanded] = field(default_factory=list)
    taken_over_s: float | None = None
    others_s: float | None = None
    """When the vehicle first left for a mode that the companion had not commanded last."""
    armed_s: float | None = None
    disarmed_s: float | None = None


def read_wire(
    packets: Iterable[tuple[float, bool, bytes]],
    dialect: AutopilotDialect,
    engaged_s: float | None,
) -> WireLog:
    """Read packets in the order in which they passed.

    Args:
        packets: time, whether the companion sent it, and the packet, whole.
        dialect: the autopilot's.
        engaged_s: when the companion asked for the mode in which setpoints fly the vehicle; what
            changes the mode afterwards takes over, or is the companion's landing.  None: never.
    """
    reader = _Reader(dialect, engaged_s)
    framer = Framer()
    for time_s, sent, raw in packets:
        for frame in framer.feed(raw):
            if sent:
                reader.take_sent(time_s, frame)
            elif frame.component_id == COMPONENT_TRUTH:
                reader.take_truth(time_s, frame)
            elif frame.component_id == COMPONENT_AUTOPILOT:
                reader.take_telemetry(time_s, frame)
    return reader.found


class _Reader:
    def __init__(self, dialect: AutopilotDialect, engaged_s: float | None) -> None:
        self.found = WireLog()
        self._dialect = dialect
        self._engaged_s = math.inf if engaged_s is None else engaged_s
        self._newest_stamp_s = -math.inf
        self._new_state_s = -math.inf
        self._sequence: tuple[int, float] | None = None
        self._mode_command: Commanded | None = None
        self._obeyed = False
        self._was_armed = False
        self._events: set[TruthEvent] = set()

    def take_sent(self, time_s: float, frame: Frame) -> None:
        if frame.message_id == MessageId.SET_ATTITUDE_TARGET:
            self.found.setpoints.append(self._setpoint(time_s, frame))
        elif frame.message_id == MessageId.COMMAND_LONG:
            fields = _fields(frame, _COMMAND_LONG)
            self._take_command(Commanded(time_s, fields[7], fields[:3]))
        elif frame.message_id == MessageId.COMMAND_INT:
            fields = _fields(frame, _COMMAND_INT)
            self._take_command(Commanded(time_s, fields[7], fields[:3]))

    def take_truth(self, time_s: float, frame: Frame) -> None:
        found = self.found
        if frame.message_id == MessageId.ODOMETRY:
            state = state_from_odometry(frame)
            if isinstance(state, Rejected):
                return
            found.truth_times_s.append(time_s)
            found.truth_stamps_s.append(state.time_s)
            found.truth_positions_enu_m.append(state.position_enu_m)
            found.truth_velocities_enu_m_s.append(state.velocity_enu_m_s)
            found.truth_tilts_rad.append(_angle(tilt_cosine(state.attitude_flu_to_enu)))
        elif frame.message_id == MessageId.NAMED_VALUE_FLOAT:
            event = truth_event(frame)
            if not isinstance(event, Rejected) and event not in self._events:
                self._events.add(event)
                found.events.append((time_s, event))

    def take_telemetry(self, time_s: float, frame: Frame) -> None:
        if frame.message_id not in _LISTENED_TO or self._overtaken(time_s, frame):
            return
        if frame.message_id in _STAMPS:
            layout, unit_s = _STAMPS[MessageId(frame.message_id)]
            stamp_s = _fields(frame, layout)[0] * unit_s
            if not 0.0 <= self._newest_stamp_s - stamp_s < _BEGAN_ANEW_S:
                self._newest_stamp_s, self._new_state_s = stamp_s, time_s
        elif frame.message_id == MessageId.HEARTBEAT:
            custom_mode, _, _, base_mode, _, _ = _fields(frame, _HEARTBEAT)
            self._take_mode(time_s, custom_mode)
            armed = bool(base_mode & BASE_MODE_ARMED)
            if self._was_armed and not armed and self.found.disarmed_s is None:
                self.found.disarmed_s = time_s
            if armed and self.found.armed_s is None:
                self.found.armed_s = time_s
            self._was_armed = self._was_armed or armed
        elif frame.message_id == MessageId.CURRENT_MODE:
            self._take_mode(time_s, int.from_bytes(frame.payload[:4], "little"))

    def _overtaken(self, time_s: float, frame: Frame) -> bool:
        """Whether a later packet arrived before it: what it says of the mode is no news."""
        before = self._sequence
        if before is not None and time_s - before[1] < _OVERTAKEN_WITHIN_S:
            ahead = (frame.sequence - before[0]) & 0xFF
            if ahead == 0 or ahead > 127:
                return True
        self._sequence = (frame.sequence, time_s)
        return False

    def _take_mode(self, time_s: float, custom_mode: int) -> None:
        found = self.found
        if time_s < self._engaged_s or found.others_s is not None:
            return
        if self._dialect.mode_name(custom_mode) == self._dialect.setpoint_mode:
            self._obeyed = True
        elif self._obeyed:
            if found.taken_over_s is None:
                found.taken_over_s = time_s
            if not self._commanded(custom_mode):
                found.others_s = time_s

    def _commanded(self, custom_mode: int) -> bool:
        """Whether it is the mode that the companion has commanded last."""
        if self._mode_command is None:
            return False
        try:
            wanted = self._dialect.set_mode(Target(1), self._dialect.mode_name(custom_mode))
        except KeyError:
            return False
        return self._mode_command.params == wanted.params[:3]

    def _take_command(self, command: Commanded) -> None:
        self.found.commands.append(command)
        if command.command_id == CommandId.DO_SET_MODE:
            self._mode_command = command

    def _setpoint(self, time_s: float, frame: Frame) -> Setpoint:
        _, w, x, y, z, p, q, r, thrust, _, _, mask = _fields(frame, _SETPOINT)
        numbers = (p, q, r, thrust) if mask == _RATES_ONLY else (w, x, y, z, thrust)
        finite = all(math.isfinite(number) for number in numbers)
        by_rates = mask == _RATES_ONLY
        return Setpoint(
            time_s,
            finite,
            0.0 if by_rates or not finite else _angle(tilt_cosine((w, x, y, z))),
            thrust,
            math.hypot(p, q, r) if by_rates and finite else 0.0,
            time_s - self._new_state_s,
        )


def _fields(frame: Frame, layout: struct.Struct) -> tuple[Any, ...]:
    return layout.unpack(frame.payload.ljust(layout.size, b"\0")[: layout.size])


def _angle(cosine: float) -> float:
    return math.acos(max(-1.0, min(1.0, cosine)))
