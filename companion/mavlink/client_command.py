"""Commands of clients, whichever of the two messages carries them."""

import math
from dataclasses import dataclass

from companion.mavlink.codec import decode
from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId, Target

DO_SET_MODE = 176
_DO_REPOSITION = 192
_DO_PAUSE_CONTINUE = 193
_OVERRIDE_GOTO = 252
ARM_DISARM = 400
SET_MESSAGE_INTERVAL = 511
_COMMAND_NAMES = {
    22: "NAV_TAKEOFF",
    24: "NAV_TAKEOFF_LOCAL",
    DO_SET_MODE: "DO_SET_MODE",
    178: "DO_CHANGE_SPEED",
    179: "DO_SET_HOME",
    _DO_REPOSITION: "DO_REPOSITION",
    _DO_PAUSE_CONTINUE: "DO_PAUSE_CONTINUE",
    241: "PREFLIGHT_CALIBRATION",
    245: "PREFLIGHT_STORAGE",
    246: "PREFLIGHT_REBOOT_SHUTDOWN",
    _OVERRIDE_GOTO: "OVERRIDE_GOTO",
    300: "MISSION_START",
    ARM_DISARM: "COMPONENT_ARM_DISARM",
    SET_MESSAGE_INTERVAL: "SET_MESSAGE_INTERVAL",
}

_NO_PLACE = 0x7FFFFFFF


@dataclass(frozen=True, slots=True)
class ClientCommand:
    """A COMMAND_LONG or COMMAND_INT."""

    command_id: int
    target: Target
    params: tuple[float, float, float, float]
    """The first four."""
    has_place: bool
    """Its fields 5 to 7 say where, or how high."""

    @property
    def name(self) -> str:
        """For a person."""
        return _COMMAND_NAMES.get(self.command_id, f"command {self.command_id}")

    @property
    def is_pause(self) -> bool:
        """It asks to hold where the vehicle is; what each autopilot makes of it is another matter.

        A ground station's "pause" on PX4 is to go nowhere else.
        """
        if self.command_id in (_DO_PAUSE_CONTINUE, _OVERRIDE_GOTO):
            return self.params[0] == 0.0
        return self.command_id == _DO_REPOSITION and not self.has_place


def read_command(frame: Frame) -> ClientCommand | None:
    """The command in a frame; None if it is no command."""
    if frame.message_id not in (MessageId.COMMAND_LONG, MessageId.COMMAND_INT):
        return None
    message = decode(frame)
    if frame.message_id == MessageId.COMMAND_LONG:
        nowhere = math.isnan(message.param5) and math.isnan(message.param6)
        has_place = not (nowhere and math.isnan(message.param7))
    else:
        has_place = not (message.x == message.y == _NO_PLACE and math.isnan(message.z))
    return ClientCommand(
        int(message.command),
        Target(message.target_system, message.target_component),
        (message.param1, message.param2, message.param3, message.param4),
        has_place,
    )
