"""MAVLink over TCP to one vehicle, made anew whenever it is lost.

`tcpout` connects, `tcpin` listens.  A connection on which nothing comes for three seconds is
half-open for all we know, and is cut: the next one may be alive.  Setpoints do not queue up in a
connection that takes none: it is cut, too, and what waited in it is gone.
"""

import asyncio
import contextlib
import socket
from collections.abc import Callable

from companion.link.link import LinkCounters, LinkError, OnBytes, OnChange
from companion.link.reconnection import BLOCKED_AFTER_S, SILENT_AFTER_S, Backoff
from companion.link.tcp_stream import TcpStream, why
from companion.link.url import LinkUrl

_LIMIT_BYTES = 4096
"""May wait to be sent: some 80 setpoints, and more than is on its way over a slow network."""
_READ_BYTES = 65_536
"""Read at once, so that the system's buffer never becomes a queue of old states."""
_CONNECT_S = 4.0
_WATCH_S = 0.25
_MOST_STRANGERS = 4
_INTRODUCTION_BYTES = 8192
"""So much of a stranger's words is looked through for a vehicle's heartbeat."""
_MOST_WORDS = 64
"""So often: who says his heartbeat byte by byte is still understood."""


class _TcpLink:
    """What both directions have in common: at most one peer, bounded, watched."""

    def __init__(self, url: LinkUrl) -> None:
        self.url = url
        self.counters = LinkCounters()
        self.on_bytes: OnBytes | None = None
        self.on_change: OnChange | None = None
        self.down_because = "not connected yet"
        self.datagrams = False
        self.speaks_first = False
        self._stream: TcpStream | None = None
        self._tasks: list[asyncio.Task[None]] = []

    @property
    def description(self) -> str:
        """Where it leads, for a person."""
        return str(self.url)

    def send(self, data: bytes) -> None:
        """Send packets to the peer; dropped and counted if there is none, or it takes none."""
        stream = self._stream
        if stream is None or not stream.send(data):
            self.counters.unsent_packets += 1
            return
        self.counters.packets_out += 1
        self.counters.bytes_out += len(data)

    def close(self) -> None:
        """End the connection, and make no other."""
        for task in self._tasks:
            task.cancel()
        self._tasks = []
        stream, self._stream = self._stream, None
        if stream is not None:
            stream.cut()
        self.down_because = "closed"

    def _begin(self, stream: TcpStream) -> None:
        self._stream = stream
        self.counters.connections += 1
        self._changed("")

    def _end(self, stream: TcpStream, reason: str) -> None:
        if stream is self._stream:
            self._stream = None
            self._changed(reason)

    def _changed(self, down_because: str) -> None:
        self.down_because = down_because
        if self.on_change is not None:
            self.on_change(down_because)

    def _take(self, stream: TcpStream, data: bytes, now_s: float) -> None:
        if stream is not self._stream:
            return
        self.counters.packets_in += 1
        self.counters.bytes_in += len(data)
        if self.on_bytes is not None:
            self.on_bytes(data, now_s)

    def _check_peer(self, now_s: float) -> None:
        """Cut a peer that is silent, or takes nothing."""
        stream = self._stream
        if stream is None:
            return
        if now_s - stream.heard_s > SILENT_AFTER_S:
            stream.cut(f"nothing came for {SILENT_AFTER_S:g} s")
        elif stream.full_for_s(now_s) > BLOCKED_AFTER_S:
            stream.cut(f"the other side took nothing for {BLOCKED_AFTER_S:g} s")


class TcpOutLink(_TcpLink):
    """A connection that we make, and make again."""

    async def open(self) -> None:
        """Begin to connect; a vehicle that is not there yet is waited for.

        Raises:
            LinkError: the host is unknown.
        """
        loop = asyncio.get_running_loop()
        await _resolve(self.url, loop)
        self._tasks = [loop.create_task(self._keep_connected(loop))]

    async def _keep_connected(self, loop: asyncio.AbstractEventLoop) -> None:
        backoff = Backoff()
        while True:
            ended = asyncio.Event()

            def on_lost(stream: TcpStream, reason: str, ended: asyncio.Event = ended) -> None:
                self._end(stream, reason)
                ended.set()

            def make(on_lost: Callable[[TcpStream, str], None] = on_lost) -> TcpStream:
                return TcpStream(
                    _LIMIT_BYTES, self._take, self._begin, on_lost, read_bytes=_READ_BYTES
                )

            try:
                async with asyncio.timeout(_CONNECT_S):
                    await loop.create_connection(make, self.url.host, self.url.port)
            except (OSError, TimeoutError) as error:
                self.counters.errors += 1
                late = isinstance(error, TimeoutError) and not str(error)
                reason = f"no answer within {_CONNECT_S:g} s" if late else why(error)
                if reason != self.down_because:
                    self._changed(reason)
            else:
                heard_before = self.counters.bytes_in
                while not ended.is_set():
                    with contextlib.suppress(TimeoutError):
                        async with asyncio.timeout(_WATCH_S):
                            await ended.wait()
                    self._check_peer(loop.time())
                if self.counters.bytes_in > heard_before:
                    backoff.reset()
            await asyncio.sleep(backoff.next_s())


class TcpInLink(_TcpLink):
    """A port at which the vehicle calls.  Who speaks as a vehicle first is the peer, alone."""

    def __init__(self, url: LinkUrl, accept_peer: Callable[[bytes], bool]) -> None:
        """Prepare a link; nothing is opened yet.

        Args:
            url: where to listen.
            accept_peer: decides by what a caller has said so far whether it is the peer.
        """
        super().__init__(url)
        self.local: tuple[str, int] | None = None
        """Where it listens: the port that was free, if 0 was asked for."""
        self._accept_peer = accept_peer
        self._server: asyncio.Server | None = None
        self._strangers: dict[TcpStream, bytes] = {}
        """Callers who have not yet shown who they are, and what they have said."""
        self._words: dict[TcpStream, int] = {}
        """How often they have said something."""

    @property
    def description(self) -> str:
        """Where it leads, for a person."""
        if self.local is None:
            return str(self.url)
        return str(LinkUrl("tcpin", self.url.host, self.local[1]))

    async def open(self) -> None:
        """Listen.

        Raises:
            LinkError: the host is unknown, or the address is taken or not this computer's.
        """
        loop = asyncio.get_running_loop()
        await _resolve(self.url, loop)
        try:
            self._server = await loop.create_server(
                lambda: TcpStream(
                    _LIMIT_BYTES, self._hear, self._greet, self._lose, read_bytes=_READ_BYTES
                ),
                self.url.host,
                self.url.port,
            )
        except OSError as error:
            raise LinkError(
                f"The link {self.url} cannot be opened: {why(error)}. If another program has TCP "
                f"port {self.url.port}, end it or choose another port; if the host is not an "
                "address of this computer, use 127.0.0.1, or 0.0.0.0 for all of its networks."
            ) from error
        self.local = self._server.sockets[0].getsockname()[:2]
        self.down_because = "nobody has called yet"
        self._tasks = [loop.create_task(self._watch(loop))]

    def close(self) -> None:
        """Listen no more, and end the connection."""
        if self._server is not None:
            self._server.close()
            self._server = None
        for stranger in list(self._strangers):
            stranger.cut()
        self._strangers.clear()
        super().close()

    def _greet(self, stream: TcpStream) -> None:
        if self._stream is not None or len(self._strangers) >= _MOST_STRANGERS:
            self.counters.foreign_packets += 1
            stream.cut()
            return
        self._strangers[stream] = b""

    def _hear(self, stream: TcpStream, data: bytes, now_s: float) -> None:
        if stream is self._stream:
            self._take(stream, data, now_s)
            return
        if stream not in self._strangers:
            return
        said = self._strangers[stream] + data
        self._words[stream] = self._words.get(stream, 0) + 1
        if self._accept_peer(said[:_INTRODUCTION_BYTES]):
            del self._strangers[stream]
            self._words.clear()
            for other in list(self._strangers):
                self._turn_away(other)
            self._begin(stream)
            self._take(stream, said, now_s)
        elif len(said) > _INTRODUCTION_BYTES or self._words[stream] >= _MOST_WORDS:
            self._turn_away(stream)
        else:
            self._strangers[stream] = said

    def _turn_away(self, stranger: TcpStream) -> None:
        self.counters.foreign_packets += 1
        self._strangers.pop(stranger, None)
        self._words.pop(stranger, None)
        stranger.cut()

    def _lose(self, stream: TcpStream, reason: str) -> None:
        self._strangers.pop(stream, None)
        self._words.pop(stream, None)
        self._end(stream, reason)

    async def _watch(self, loop: asyncio.AbstractEventLoop) -> None:
        while True:
            await asyncio.sleep(_WATCH_S)
            now = loop.time()
            self._check_peer(now)
            for stranger in list(self._strangers):
                if now - stranger.heard_s > SILENT_AFTER_S:
                    self._turn_away(stranger)


async def _resolve(url: LinkUrl, loop: asyncio.AbstractEventLoop) -> None:
    """Find the host.

    Raises:
        LinkError: nobody knows it.
    """
    try:
        await loop.getaddrinfo(url.host, url.port, type=socket.SOCK_STREAM)
    except OSError as error:
        raise LinkError(
            f"The link {url} cannot be opened: the host {url.host!r} is not known ({error}). "
            "Check the spelling, or give its address in numbers."
        ) from error
