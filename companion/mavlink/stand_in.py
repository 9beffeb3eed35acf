"""What is said in another's place on a shared link, so that who asked need not wait in vain."""

import struct

from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId, Outgoing, Target

_ACK = struct.Struct("<HBBiBB")
_SET = struct.Struct("<4xBB16s")
_REQUEST = struct.Struct("<hBB16s")
_BY_NAME = -1


def command_ack(command_id: int, result: int, asker: Target) -> Outgoing:
    """COMMAND_ACK to who asked."""
    return Outgoing(MessageId.COMMAND_ACK, _ACK.pack(command_id, result, 0, 0, *asker))


def read_instead_of_set(frame: Frame) -> Outgoing:
    """PARAM_REQUEST_READ of what a PARAM_SET would change.

    Both are answered with PARAM_VALUE: so whoever wanted to set it learns what it still is.
    """
    system, component, name = _SET.unpack(frame.payload.ljust(_SET.size, b"\0")[: _SET.size])
    return Outgoing(MessageId.PARAM_REQUEST_READ, _REQUEST.pack(_BY_NAME, system, component, name))
