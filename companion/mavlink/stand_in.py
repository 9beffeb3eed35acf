"""What is said in another's place on a shared link, so that who asked need not wait in vain."""

import struct

from companion.mavlink.codec import Packer, decode
from companion.mavlink.framing import Frame
from companion.mavlink.message_classes import MessageClass, class_of
from companion.mavlink.messages import MessageId, Outgoing, Target

_ACK = struct.Struct("<HBBiBB")
_SET = struct.Struct("<4xBB16s")
_REQUEST = struct.Struct("<hBB16s")
_BY_NAME = -1

_FILES, _MISSION_ACK, _PARAM_EXT_SET, _PARAM_EXT_ACK = 110, 47, 323, 324
_PARAM_EXT = struct.Struct("<BB16s128sB")
_PARAM_EXT_ANSWER = struct.Struct("<16s128sBB")
_FILE_HEADER = struct.Struct("<HBBBBBxI")
"""Sequence, session, operation, size, operation that is answered, end of a burst, offset."""
_NAK = 129
_FILE_PROTECTED = 9
_MISSION_DENIED = 14
_PARAM_EXT_FAILED = 3


def command_ack(command_id: int, result: int, asker: Target) -> Outgoing:
    """COMMAND_ACK to who asked."""
    return Outgoing(MessageId.COMMAND_ACK, _ACK.pack(command_id, result, 0, 0, *asker))


def read_instead_of_set(frame: Frame) -> Outgoing:
    """PARAM_REQUEST_READ of what a PARAM_SET would change.

    Both are answered with PARAM_VALUE: so whoever wanted to set it learns what it still is.
    """
    system, component, name = _SET.unpack(frame.payload.ljust(_SET.size, b"\0")[: _SET.size])
    return Outgoing(MessageId.PARAM_REQUEST_READ, _REQUEST.pack(_BY_NAME, system, component, name))


def denial(frame: Frame, asker: Target) -> Outgoing | None:
    """What says no to a client's message in the way of its own service; None if that has none."""
    if frame.message_id == _FILES:
        return _no_to_files(frame, asker)
    if frame.message_id == _PARAM_EXT_SET:
        return _no_to_extended_parameter(frame)
    if class_of(frame.message_id) is MessageClass.MISSION:
        kind = decode(frame).mission_type
        return Outgoing(_MISSION_ACK, bytes((*asker, _MISSION_DENIED, kind)))
    return None


def _no_to_files(frame: Frame, asker: Target) -> Outgoing:
    """https://mavlink.io/en/services/ftp.html: NAK "file protected" to an operation."""
    asked = bytes(decode(frame).payload)
    sequence, session, operation, *_ = _FILE_HEADER.unpack_from(asked)
    header = _FILE_HEADER.pack((sequence + 1) & 0xFFFF, session, _NAK, 1, operation, 0, 0)
    return Outgoing(_FILES, bytes((0, *asker)) + header + bytes((_FILE_PROTECTED,)))


def _no_to_extended_parameter(frame: Frame) -> Outgoing:
    """PARAM_EXT_ACK; it repeats name, value and type."""
    payload = frame.payload.ljust(_PARAM_EXT.size, b"\0")
    _, _, name, value, kind = _PARAM_EXT.unpack_from(payload)
    return Outgoing(_PARAM_EXT_ACK, _PARAM_EXT_ANSWER.pack(name, value, kind, _PARAM_EXT_FAILED))


class StandIn:
    """Answers in a vehicle's name.

    Not signed, even on a link with a key: our stamp could make the vehicle's own next packet look
    like a replay.
    """

    def __init__(self, vehicle: Target) -> None:
        self._vehicle = vehicle
        self._packer = Packer(*vehicle)

    def acknowledge(self, frame: Frame, command_id: int, target: Target, result: int) -> bytes:
        """COMMAND_ACK to a command in a frame, from the component that it was for."""
        return self._say(command_ack(command_id, result, _sender(frame)), target.component_id)

    def deny(self, frame: Frame) -> bytes | None:
        """The denial of a message; None if its sender expects none."""
        answer = denial(frame, _sender(frame))
        return None if answer is None else self._say(answer, self._vehicle.component_id)

    def _say(self, outgoing: Outgoing, component_id: int) -> bytes:
        self._packer.component_id = component_id or self._vehicle.component_id
        return self._packer.pack(outgoing)


def _sender(frame: Frame) -> Target:
    return Target(frame.system_id, frame.component_id)
