"""Commands (MAV_CMD) and their acknowledgements: the messages, without the waiting.

Service: https://mavlink.io/en/services/command.html.
"""

import math
import struct
from dataclasses import dataclass
from enum import IntEnum

from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId, Outgoing, Target

_LONG = struct.Struct("<7fHBBB")
_ACK = struct.Struct("<HBBiBB")

FORCE = 21196.0
"""Param 2 of an arm or disarm command that must be obeyed whatever the autopilot thinks."""


class CommandId(IntEnum):
    """The commands that the companion sends."""

    NAV_RETURN_TO_LAUNCH = 20
    NAV_TAKEOFF = 22
    DO_SET_MODE = 176
    COMPONENT_ARM_DISARM = 400
    SET_MESSAGE_INTERVAL = 511


class Result(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    CANCELLED = 6
    COMMAND_LONG_ONLY = 7
    COMMAND_INT_ONLY = 8
    UNSUPPORTED_FRAME = 9
    NOT_IN_CONTROL = 10


def result_name(result: int) -> str:
    """A MAV_RESULT in words."""
    try:
        return Result(result).name.lower().replace("_", " ")
    except ValueError:
        return f"result {result}"


@dataclass(frozen=True, slots=True)
class Command:
    """A command and whom it is for."""

    command_id: int
    target: Target
    params: tuple[float, float, float, float, float, float, float] = (0.0,) * 7

    @property
    def label(self) -> str:
        """Name for messages to a person."""
        try:
            return CommandId(self.command_id).name
        except ValueError:
            return f"command {self.command_id}"

    def as_long(self, confirmation: int = 0) -> Outgoing:
        """COMMAND_LONG; `confirmation` counts the repetitions."""
        return Outgoing(
            MessageId.COMMAND_LONG,
            _LONG.pack(*self.params, self.command_id, *self.target, min(confirmation, 255)),
        )


@dataclass(frozen=True, slots=True)
class Ack:
    """A COMMAND_ACK."""

    command_id: int
    result: int
    progress: int = 0
    detail: int = 0
    """`result_param2`: what the autopilot adds to the result."""
    target_system: int = 0
    """Whom it answers, or 0 if the autopilot does not say."""
    target_component: int = 0


def ack_from_frame(frame: Frame) -> Ack:
    """Read a COMMAND_ACK."""
    return Ack(*_ACK.unpack_from(frame.payload.ljust(_ACK.size, b"\0")))


def arm(target: Target, *, force: bool = False) -> Command:
    """Arm the motors; `force` skips the autopilot's checks."""
    return _command(CommandId.COMPONENT_ARM_DISARM, target, 1.0, FORCE if force else 0.0)


def disarm(target: Target, *, force: bool = False) -> Command:
    """Stop the motors.  With `force` in the air too: the vehicle falls."""
    return _command(CommandId.COMPONENT_ARM_DISARM, target, 0.0, FORCE if force else 0.0)


def takeoff_here(target: Target) -> Command:
    """Take off where the vehicle stands, to the autopilot's own height (all parameters NaN)."""
    return Command(CommandId.NAV_TAKEOFF, target, (math.nan,) * 7)


def takeoff_to(target: Target, height_m: float) -> Command:
    """Take off where the vehicle stands, to a height above that (ArduPilot).

    Raises:
        ValueError: the height is not a positive number.
    """
    if not 0.0 < height_m < math.inf:
        raise ValueError(f"a take-off cannot go to a height of {height_m} m")
    return _command(CommandId.NAV_TAKEOFF, target, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, height_m)


def message_interval(target: Target, message_id: int, interval_s: float | None) -> Command:
    """Ask for a message at an interval; 0 restores the autopilot's default, None stops it.

    Raises:
        ValueError: the interval is negative or not finite.
    """
    if interval_s is None:
        interval_us = -1.0
    elif 0.0 <= interval_s < math.inf:
        interval_us = round(interval_s * 1e6)
    else:
        raise ValueError(f"a message interval cannot be {interval_s} s")
    return _command(CommandId.SET_MESSAGE_INTERVAL, target, message_id, interval_us)


def _command(command_id: CommandId, target: Target, *params: float) -> Command:
    p1, p2, p3, p4, p5, p6, p7 = (*params, *(0.0,) * (7 - len(params)))
    return Command(command_id, target, (p1, p2, p3, p4, p5, p6, p7))
