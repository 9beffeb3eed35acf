"""MAVLink FTP, of which there is only the refusal: no file exists here.

A client that tries files first (MAVProxy its parameters) falls back at once when it is told so,
and after many seconds when it is not.  https://mavlink.io/en/services/ftp.html
"""

import struct
from collections.abc import Callable, Mapping

from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.wire import Message, dialect

_HEADER = struct.Struct("<HBBBBBxI")
"""Sequence number, session, opcode, size, requested opcode, burst complete, offset."""
_PAYLOAD_BYTES = 251
_RESET_SESSIONS, _TERMINATE_SESSION = 2, 1
_ACK, _NAK = 128, 129
_INVALID_SESSION, _FILE_NOT_FOUND = 4, 10


class Files:
    """Answers about files.

    Args:
        context: of the vehicle.
    """

    def __init__(self, context: Context) -> None:
        self._context = context

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        return {"FILE_TRANSFER_PROTOCOL": self._answer}

    def step(self, now_us: int) -> None:
        """Nothing is sent unasked."""

    def _answer(self, link: int, message: Message) -> None:
        if self._context.concerns(message):
            self._context.links[link].send(answer(message))


def answer(request: Message) -> Message:
    """The answer to any FILE_TRANSFER_PROTOCOL request."""
    head = bytes(request.payload[: _HEADER.size])
    sequence, session, opcode, *_ = _HEADER.unpack(head)
    if opcode == _RESET_SESSIONS:
        kind, data = _ACK, b""
    else:
        reason = _INVALID_SESSION if opcode == _TERMINATE_SESSION else _FILE_NOT_FOUND
        kind, data = _NAK, bytes([reason])
    reply = _HEADER.pack((sequence + 1) & 0xFFFF, session, kind, len(data), opcode, 0, 0) + data
    return dialect.MAVLink_file_transfer_protocol_message(
        0,
        request.get_srcSystem(),
        request.get_srcComponent(),
        reply.ljust(_PAYLOAD_BYTES, b"\0"),
    )
