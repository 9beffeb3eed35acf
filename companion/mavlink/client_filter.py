"""What a client of a forwarding endpoint may tell the vehicle while the companion flies it.

Two controllers that steer one vehicle crash it, so what starts or steers something is kept back.
What ends the companion's flight is not: a person at a ground station can take over at any time,
by landing, returning, holding, a position mode, or, in an emergency, by stopping the motors.  Once
the flight is handed over, only automatic setpoints are kept back.

`message_classes` says what each message is; commands are kept back unless they are named here.
docs/decisions has the reasons.
"""

import math
from dataclasses import dataclass

from companion.mavlink.client_command import (
    ARM_DISARM,
    DO_SET_MODE,
    SET_MESSAGE_INTERVAL,
    ClientCommand,
    read_command,
)
from companion.mavlink.codec import decode
from companion.mavlink.commands import Result
from companion.mavlink.dialect import message_name
from companion.mavlink.dialects.base import AutopilotDialect
from companion.mavlink.framing import Frame
from companion.mavlink.message_classes import MessageClass, class_of
from companion.mavlink.messages import MessageId, Target

_SET_MODE = 11
_MISSION_ITEMS = frozenset({39, 73})
_FENCE, _ALL_KINDS = 1, 255
"""MAV_MISSION_TYPE."""

_FILE_OPERATIONS_THAT_READ = frozenset({0, 1, 2, 3, 4, 5, 14, 15})
"""None, end a session or all, list, open to read, read, checksum, read in a burst."""
_FILE_OPERATION_AT = 3

_HARMLESS_COMMANDS = frozenset(
    {*range(200, 207), 401, 410, 510, 512, *range(519, 535), 1000, 1001}
    | {*range(2000, 2004), *range(2500, 2512)}
)
"""Cameras, gimbals, logging, and requests for a message."""
_ENDING_COMMANDS = frozenset({17, 20, 21, 185})
"""NAV_LOITER_UNLIM, NAV_RETURN_TO_LAUNCH, NAV_LAND, DO_FLIGHTTERMINATION."""
_MODES_OF_A_TAKEOVER = {
    "px4": frozenset({"loiter", "land", "rtl", "posctl", "altctl"}),
    "ardupilot": frozenset({"brake", "land", "rtl", "smart_rtl", "loiter", "poshold", "alt_hold"}),
}
"""Modes in which the autopilot itself keeps the vehicle level, at least."""

_PAUSE_BY_HANDING_OVER = frozenset({"ardupilot"})
"""In GUIDED it denies every command to pause and obeys the next setpoint."""
_PASSES = frozenset({MessageClass.HARMLESS, MessageClass.TIME, MessageClass.RATES})
"""What is made of the last two, who forwards decides."""

_CUSTOM_MODE = 0x01


@dataclass(frozen=True, slots=True)
class Situation:
    """What the verdict depends on."""

    vehicle: Target
    dialect: AutopilotDialect
    armed: bool
    pilot_flies: bool
    """The companion has handed over."""
    allow_setpoints: bool = False
    allow_commands: bool = False


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a frame is not passed on."""

    what: str
    """The message or command."""
    why: str
    command_id: int | None = None
    """What a COMMAND_ACK must name; None if the sender expects none."""
    target: Target | None = None
    """Whom the command was for: who has to answer."""
    result: Result = Result.DENIED
    pauses: bool = False
    """It asks for a pause, which the companion itself must make."""


def judge(frame: Frame, situation: Situation) -> Refusal | None:
    """Whether a client's frame must not reach the vehicle; None if it may.

    Args:
        frame: from a client of an endpoint.
        situation: the flight's, and what the endpoint is allowed.
    """
    message_id = frame.message_id
    vehicle = situation.vehicle
    kind = class_of(message_id)
    if kind is MessageClass.LOCKS_OUT:
        return Refusal("SETUP_SIGNING", "it would lock the companion out")
    command = read_command(frame)
    if command is not None:
        # Of whatever component: autopilots obey some commands that name another one of theirs.
        if command.target.system_id not in (0, vehicle.system_id):
            return None
        return _refused_command(command, situation)
    if kind in _PASSES or not _is_for(frame, vehicle):
        return None
    if kind is MessageClass.STICKS:
        if situation.allow_setpoints or situation.pilot_flies:
            return None
        return Refusal(
            message_name(message_id), "the companion flies; sticks pass once it does not"
        )
    if kind is MessageClass.STEERS:
        if situation.allow_setpoints:
            return None
        return Refusal(message_name(message_id), "only the companion steers (allow_setpoints)")
    if situation.allow_commands or situation.pilot_flies:
        return None
    if kind is MessageClass.MODE:
        return _refused_mode(frame, situation)
    why = _why_not_message(frame, kind, situation)
    return None if why is None else Refusal(message_name(message_id), why)


def _refused_mode(frame: Frame, situation: Situation) -> Refusal | None:
    message = decode(frame)
    wanted = message.custom_mode if message.base_mode & _CUSTOM_MODE else None
    why = _why_not_mode(wanted, situation)
    return None if why is None else Refusal("SET_MODE", why, _SET_MODE, situation.vehicle)


def _why_not_message(frame: Frame, kind: MessageClass, situation: Situation) -> str | None:
    """Why a message that changes something is kept back; None if it passes."""
    if kind is MessageClass.CHANGES:
        return "nothing is changed while the companion flies"
    if frame.message_id in _MISSION_ITEMS and _is_guided_item(frame):
        return "only the companion steers (allow_commands)"
    if not situation.armed:
        return None
    if kind is MessageClass.FILES and _operation(frame) in _FILE_OPERATIONS_THAT_READ:
        return None
    if kind is MessageClass.MISSION:
        if decode(frame).mission_type not in (_FENCE, _ALL_KINDS):
            return None
        return "no fence is changed while the vehicle is armed"
    if frame.message_id == MessageId.PARAM_SET:
        return "no parameter is changed while the vehicle is armed"
    return "nothing of that kind is changed while the vehicle is armed"


def _refused_command(command: ClientCommand, situation: Situation) -> Refusal | None:
    pauses = command.is_pause and situation.armed and not situation.pilot_flies
    if pauses and situation.dialect.name in _PAUSE_BY_HANDING_OVER:
        title = situation.dialect.title
        instead = f"{title} does not heed it: choose mode brake, land or loiter instead"
        return Refusal(command.name, instead, command.command_id, command.target, pauses=True)
    why = _why_not_command(command, situation)
    if why is None:
        return None
    return Refusal(command.name, why, command.command_id, command.target)


def _why_not_command(command: ClientCommand, situation: Situation) -> str | None:
    """Why a command is kept back; None if it passes."""
    if situation.allow_commands or situation.pilot_flies:
        return None
    command_id, first = command.command_id, command.params[0]
    if command_id in _HARMLESS_COMMANDS or command_id in _ENDING_COMMANDS:
        return None
    if command_id == SET_MESSAGE_INTERVAL:
        return None  # whether it may depends on what the flight asked for: see stream_requests
    if command_id == DO_SET_MODE:
        return _why_not_mode(_wanted_mode(command, situation), situation)
    if command_id == ARM_DISARM:
        return None if abs(first) < 0.5 else "the companion arms; disarming is always passed"
    if command.is_pause:
        return None
    return "the companion flies; what lands, returns, holds or disarms is always passed"


def _why_not_mode(custom_mode: int | None, situation: Situation) -> str | None:
    if custom_mode is None:
        return "it names no mode of the autopilot's own"
    name = situation.dialect.mode_name(custom_mode)
    takeover = _MODES_OF_A_TAKEOVER.get(situation.dialect.name, frozenset())
    if name in takeover:
        return None
    return f"mode {name} is not for a client; {', '.join(sorted(takeover))} always are"


def _wanted_mode(command: ClientCommand, situation: Situation) -> int | None:
    """The `custom_mode` of a DO_SET_MODE, or None if it does not say one."""
    base, main, sub, _ = command.params
    if not all(math.isfinite(p) and 0.0 <= p < 2.0**32 for p in (base, main)):
        return None
    if not int(base) & _CUSTOM_MODE:
        return None
    if situation.dialect.name != "px4":
        return int(main)
    sub = sub if math.isfinite(sub) and 0.0 <= sub < 256.0 else 0.0
    return int(sub) << 24 | (int(main) & 0xFF) << 16


def _is_for(frame: Frame, vehicle: Target) -> bool:
    """False if the message names another system; many name none."""
    if not frame.decodable:
        return True
    message = decode(frame)
    named = getattr(message, "target_system", getattr(message, "target", 0))
    return named in (0, vehicle.system_id)


def _is_guided_item(frame: Frame) -> bool:
    """True for ArduPilot's old way to send a place to fly to: `current` is 2 or 3."""
    return bool(decode(frame).current >= 2)


def _operation(frame: Frame) -> int:
    """What a FILE_TRANSFER_PROTOCOL asks for."""
    return int(decode(frame).payload[_FILE_OPERATION_AT])
