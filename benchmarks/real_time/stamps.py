"""The system's own stamps of arriving datagrams (SO_TIMESTAMPNS, socket(7))."""

import socket
import struct
import time
from typing import Any

_SO_TIMESTAMPNS = getattr(socket, "SO_TIMESTAMPNS", 35)
_TIMESPEC = struct.Struct("@ll")
_LARGEST = 65_536
_NS_PER_S = 1_000_000_000

Address = tuple[str, int]


def stamped(receiver: socket.socket) -> None:
    """Let a socket's datagrams be stamped from now on."""
    receiver.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)


def receive_stamped(receiver: socket.socket) -> tuple[bytes, Address, int]:
    """Data, sender, and when it came by the calendar's clock, ns; now, if it is not stamped.

    Raises:
        OSError: as of `socket.recvmsg`.
    """
    data, ancillary, _, sender = receiver.recvmsg(_LARGEST, socket.CMSG_SPACE(_TIMESPEC.size))
    return data, sender, _stamp_ns(ancillary)


def _stamp_ns(ancillary: list[tuple[int, int, Any]]) -> int:
    for level, kind, value in ancillary:
        if level == socket.SOL_SOCKET and kind == _SO_TIMESTAMPNS:
            seconds, nanoseconds = _TIMESPEC.unpack(value[: _TIMESPEC.size])
            return int(seconds * _NS_PER_S + nanoseconds)
    return time.time_ns()
