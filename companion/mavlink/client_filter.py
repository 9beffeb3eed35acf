"""What a client of a forwarding endpoint may tell the vehicle while the companion flies it.

Two controllers that steer one vehicle crash it, so what starts or steers something is kept back.
What ends the companion's flight is not: a person at a ground station can take over at any time,
by landing, returning, holding, a position mode, or, in an emergency, by stopping the motors.  Once
the flight is handed over, only automatic setpoints are kept back.  Messages are let through unless
they are named here; commands are kept back unless they are.  docs/decisions has the reasons.
"""

import math
from dataclasses import dataclass

from companion.mavlink.codec import decode
from companion.mavlink.commands import Result
from companion.mavlink.dialect import message_name
from companion.mavlink.dialects.base import AutopilotDialect
from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId, Target

_SET_MODE = 11
_SETUP_SIGNING = 256
_MISSION_ITEMS = frozenset({39, 73})
_STICKS = frozenset({69, 70, 420})
"""MANUAL_CONTROL, RC_CHANNELS_OVERRIDE, RADIO_RC_CHANNELS."""
_SETPOINTS = frozenset({81, 82, 84, 86, 139, 144, 149, 332, 333})
"""Of position, attitude, actuators, manual ones; targets to follow or land on; trajectories."""
_ESTIMATES = frozenset(
    {90, 91, 92, 93, 100, 101, 102, 103, 104, 106, 107, 113, 114, 115, 132, 138, 232, 331}
)
"""Poses, simulated sensors and GNSS: who moves the estimate moves the vehicle."""
_CHANGES = frozenset({5, 48, 50, 126, 151, 243})
"""CHANGE_OPERATOR_CONTROL, origin and home, PARAM_MAP_RC, SERIAL_CONTROL, SET_MAG_OFFSETS."""

_HARMLESS_COMMANDS = frozenset(
    {*range(200, 207), 401, 410, 510, 512, *range(519, 535), 1000, 1001}
    | {*range(2000, 2004), *range(2500, 2512)}
)
"""Cameras, gimbals, logging, and requests for a message."""
_ENDING_COMMANDS = frozenset({17, 20, 21, 185})
"""NAV_LOITER_UNLIM, NAV_RETURN_TO_LAUNCH, NAV_LAND, DO_FLIGHTTERMINATION."""
_DO_SET_MODE = 176
_DO_REPOSITION = 192
_DO_PAUSE_CONTINUE = 193
_OVERRIDE_GOTO = 252
_ARM_DISARM = 400
SET_MESSAGE_INTERVAL = 511
_COMMAND_NAMES = {
    22: "NAV_TAKEOFF",
    24: "NAV_TAKEOFF_LOCAL",
    _DO_SET_MODE: "DO_SET_MODE",
    178: "DO_CHANGE_SPEED",
    179: "DO_SET_HOME",
    _DO_REPOSITION: "DO_REPOSITION",
    _DO_PAUSE_CONTINUE: "DO_PAUSE_CONTINUE",
    241: "PREFLIGHT_CALIBRATION",
    245: "PREFLIGHT_STORAGE",
    246: "PREFLIGHT_REBOOT_SHUTDOWN",
    _OVERRIDE_GOTO: "OVERRIDE_GOTO",
    300: "MISSION_START",
    _ARM_DISARM: "COMPONENT_ARM_DISARM",
    SET_MESSAGE_INTERVAL: "SET_MESSAGE_INTERVAL",
}
_MODES_OF_A_TAKEOVER = {
    "px4": frozenset({"loiter", "land", "rtl", "posctl", "altctl"}),
    "ardupilot": frozenset({"brake", "land", "rtl", "smart_rtl", "loiter", "poshold", "alt_hold"}),
}
"""Modes in which the autopilot itself keeps the vehicle level, at least."""

_CUSTOM_MODE = 0x01
_NO_PLACE = 0x7FFFFFFF


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
class ClientCommand:
    """A COMMAND_LONG or COMMAND_INT."""

    command_id: int
    target: Target
    params: tuple[float, float, float, float]
    """The first four."""
    has_place: bool
    """Its fields 5 and 6 say where."""

    @property
    def name(self) -> str:
        """For a person."""
        return _COMMAND_NAMES.get(self.command_id, f"command {self.command_id}")


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


def read_command(frame: Frame) -> ClientCommand | None:
    """The command in a frame; None if it is no command."""
    if frame.message_id not in (MessageId.COMMAND_LONG, MessageId.COMMAND_INT):
        return None
    message = decode(frame)
    if frame.message_id == MessageId.COMMAND_LONG:
        has_place = not (math.isnan(message.param5) and math.isnan(message.param6))
    else:
        has_place = not message.x == message.y == _NO_PLACE
    return ClientCommand(
        int(message.command),
        Target(message.target_system, message.target_component),
        (message.param1, message.param2, message.param3, message.param4),
        has_place,
    )


def judge(frame: Frame, situation: Situation) -> Refusal | None:
    """Whether a client's frame must not reach the vehicle; None if it may.

    Args:
        frame: from a client of an endpoint.
        situation: the flight's, and what the endpoint is allowed.
    """
    message_id = frame.message_id
    vehicle = situation.vehicle
    if message_id == _SETUP_SIGNING:
        return Refusal("SETUP_SIGNING", "it would lock the companion out")
    command = read_command(frame)
    if command is not None:
        # Of whatever component: autopilots obey some commands that name another one of theirs.
        if command.target.system_id not in (0, vehicle.system_id):
            return None
        why = _why_not_command(command, situation)
        if why is None:
            return None
        return Refusal(command.name, why, command.command_id, command.target)
    if not _is_for(frame, vehicle):
        return None
    if message_id in _STICKS:
        if situation.allow_setpoints or situation.pilot_flies:
            return None
        return Refusal(
            message_name(message_id), "the companion flies; sticks pass once it does not"
        )
    if message_id in _SETPOINTS or message_id in _ESTIMATES:
        if situation.allow_setpoints:
            return None
        return Refusal(message_name(message_id), "only the companion steers (allow_setpoints)")
    if situation.allow_commands or situation.pilot_flies:
        return None
    return _why_not_message(frame, situation)


def _why_not_message(frame: Frame, situation: Situation) -> Refusal | None:
    message_id = frame.message_id
    if message_id == _SET_MODE:
        message = decode(frame)
        wanted = message.custom_mode if message.base_mode & _CUSTOM_MODE else None
        why = _why_not_mode(wanted, situation)
        return None if why is None else Refusal("SET_MODE", why, _SET_MODE, situation.vehicle)
    if message_id in _CHANGES:
        return Refusal(message_name(message_id), "nothing is changed while the companion flies")
    if message_id == MessageId.PARAM_SET and situation.armed:
        return Refusal("PARAM_SET", "no parameter is changed while the vehicle is armed")
    if message_id in _MISSION_ITEMS and _is_guided_item(frame):
        return Refusal(message_name(message_id), "only the companion steers (allow_commands)")
    return None


def _why_not_command(command: ClientCommand, situation: Situation) -> str | None:
    """Why a command is kept back; None if it passes."""
    if situation.allow_commands or situation.pilot_flies:
        return None
    command_id, first = command.command_id, command.params[0]
    if command_id in _HARMLESS_COMMANDS or command_id in _ENDING_COMMANDS:
        return None
    if command_id == SET_MESSAGE_INTERVAL:
        return None  # whether it may depends on what the flight asked for: see stream_requests
    if command_id == _DO_SET_MODE:
        return _why_not_mode(_wanted_mode(command, situation), situation)
    if command_id == _ARM_DISARM:
        return None if abs(first) < 0.5 else "the companion arms; disarming is always passed"
    holds = (
        (command_id in (_DO_PAUSE_CONTINUE, _OVERRIDE_GOTO) and first == 0.0)
        # A ground station's "pause" on PX4 is to go nowhere else.
        or (command_id == _DO_REPOSITION and not command.has_place)
    )
    if holds:
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
