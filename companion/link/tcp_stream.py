"""One TCP connection with bounded buffers, for links and for endpoints alike."""

import asyncio
import contextlib
import os
import socket
import struct
from collections.abc import Callable
from typing import cast

from companion.link.stream_writer import Congestion, waiting_in_system

_READ_BYTES = 4096
"""At most so much is read before the loop sees to something else."""
_SEND_BUFFER = 1 << 16
_USER_TIMEOUT_MS = 5000


class TcpStream(asyncio.BufferedProtocol):
    """What asyncio calls for one connection.

    It never waits: what cannot be sent while `limit_bytes` wait already is dropped, packet by
    packet, so that the frames in the stream stay whole.
    """

    def __init__(
        self,
        limit_bytes: int,
        on_bytes: "Callable[[TcpStream, bytes, float], None]",
        on_made: "Callable[[TcpStream], None] | None" = None,
        on_lost: "Callable[[TcpStream, str], None] | None" = None,
        *,
        read_bytes: int = _READ_BYTES,
    ) -> None:
        """Prepare.

        Args:
            limit_bytes: so much may wait to be sent, here and in the system.
            on_bytes: given what comes, and the loop's time.
            on_made: told when the connection is there.
            on_lost: told, with the reason, when it is gone.
            read_bytes: so much is read before the loop sees to something else.
        """
        self.heard_s = 0.0
        """When something came last; before that, when the connection was made."""
        self._congestion = Congestion(limit_bytes)
        self._on_bytes = on_bytes
        self._on_made = on_made
        self._on_lost = on_lost
        self._buffer = bytearray(read_bytes)
        self._transport: asyncio.Transport | None = None
        self._socket: socket.socket | None = None
        self._cut_because = ""
        self._time = asyncio.get_running_loop().time

    @property
    def peer(self) -> tuple[str, int]:
        """Address and port of the other side."""
        name = None if self._transport is None else self._transport.get_extra_info("peername")
        return ("", 0) if name is None else (str(name[0]), int(name[1]))

    def send(self, data: bytes) -> bool:
        """Send whole packets, or drop them; True if they are on their way."""
        transport, sock = self._transport, self._socket
        if transport is None or sock is None or transport.is_closing():
            return False
        if not self._congestion.admits(len(data), self._waiting(), self._time()):
            return False
        transport.write(data)
        return True

    def full_for_s(self, now_s: float) -> float:
        """How long it has taken nothing, though there was something to send."""
        return self._congestion.full_for_s(self._waiting(), now_s)

    def _waiting(self) -> int:
        transport, sock = self._transport, self._socket
        if transport is None or sock is None:
            return 0
        return transport.get_write_buffer_size() + waiting_in_system(sock.fileno())

    def cut(self, reason: str = "") -> None:
        """End the connection at once; what waits in it is thrown away, here and in the system."""
        transport, sock = self._transport, self._socket
        if transport is None or sock is None or transport.is_closing():
            return
        self._cut_because = reason
        with contextlib.suppress(OSError):
            # Closed with RST, not FIN: the system forgets what it has not sent yet.
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        transport.abort()

    # --- called by asyncio ---

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """The connection is there."""
        self._transport = cast("asyncio.Transport", transport)
        sock: socket.socket = transport.get_extra_info("socket")
        self._socket = sock
        _tune(sock)
        self.heard_s = self._time()
        if self._on_made is not None:
            self._on_made(self)

    def get_buffer(self, sizehint: int) -> bytearray:
        """Where the next bytes are to be put."""
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Bytes have come."""
        self.heard_s = self._time()
        self._on_bytes(self, bytes(self._buffer[:nbytes]), self.heard_s)

    def eof_received(self) -> bool:
        """The other side has ended the connection; so do we."""
        return False

    def connection_lost(self, exc: Exception | None) -> None:
        """The connection is gone."""
        self._transport = self._socket = None
        if self._on_lost is not None:
            reason = self._cut_because or (
                "the other side ended the connection" if exc is None else why(exc)
            )
            self._on_lost(self, reason)


def why(error: BaseException) -> str:
    """An error of the system in words."""
    number = error.errno if isinstance(error, OSError) else None
    if number is not None and number > 0:
        return os.strerror(number)  # asyncio's own text does not say what was wrong
    return str(error) or type(error).__name__


def _tune(sock: socket.socket) -> None:
    """Send at once, and find out within seconds that the other side is gone.

    What the system does not know it leaves out.
    """
    wanted: list[tuple[int, str, int]] = [
        (socket.SOL_SOCKET, "SO_SNDBUF", _SEND_BUFFER),
        (socket.SOL_SOCKET, "SO_KEEPALIVE", 1),
        (socket.IPPROTO_TCP, "TCP_NODELAY", 1),
        (socket.IPPROTO_TCP, "TCP_KEEPIDLE", 2),
        (socket.IPPROTO_TCP, "TCP_KEEPINTVL", 1),
        (socket.IPPROTO_TCP, "TCP_KEEPCNT", 3),
        (socket.IPPROTO_TCP, "TCP_USER_TIMEOUT", _USER_TIMEOUT_MS),
    ]
    for level, name, value in wanted:
        with contextlib.suppress(OSError, AttributeError):
            sock.setsockopt(level, getattr(socket, name), value)
