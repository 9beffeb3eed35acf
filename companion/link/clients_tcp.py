"""Clients over TCP."""

import asyncio
from collections.abc import Callable

from companion.link.clients import MOST_CLIENTS, Client, OnData, cannot_open
from companion.link.tcp_stream import TcpStream
from companion.link.url import LinkUrl

_LIMIT_BYTES = 1 << 16
"""May wait for a client: two seconds of telemetry."""
_HUNG_AFTER_S = 10.0


class _TcpClient:
    """A connection of a client."""

    def __init__(self, stream: TcpStream) -> None:
        self.stream = stream
        self.name = f"{stream.peer[0]}:{stream.peer[1]}"

    def send(self, data: bytes) -> bool:
        return self.stream.send(data)


class TcpClients:
    """Clients that call at a TCP port."""

    def __init__(self, url: LinkUrl) -> None:
        """Prepare to listen."""
        self.url = url
        self.on_data: OnData | None = None
        self.on_gone: Callable[[Client], None] | None = None
        self.datagrams = False
        self.local: tuple[str, int] | None = None
        self._server: asyncio.Server | None = None
        self._clients: dict[TcpStream, _TcpClient] = {}

    @property
    def description(self) -> str:
        """Where it is, for a person."""
        port = self.url.port if self.local is None else self.local[1]
        return str(LinkUrl(self.url.scheme, self.url.host, port))

    def present(self) -> list[Client]:
        """Who is there."""
        return list(self._clients.values())

    async def open(self) -> None:
        """Listen.

        Raises:
            LinkError: the host is unknown, or the address is taken or not this computer's.
        """
        try:
            self._server = await asyncio.get_running_loop().create_server(
                lambda: TcpStream(_LIMIT_BYTES, self._hear, self._greet, self._lose),
                self.url.host,
                self.url.port,
            )
        except OSError as error:
            raise cannot_open(self.url, error) from error
        self.local = self._server.sockets[0].getsockname()[:2]

    def tidy(self, now_s: float) -> None:
        """Cut who takes nothing."""
        for stream in list(self._clients):
            if stream.full_for_s(now_s) > _HUNG_AFTER_S:
                stream.cut("it takes nothing")

    def close(self) -> None:
        """Listen no more, and end all connections."""
        if self._server is not None:
            self._server.close()
            self._server = None
        for stream in list(self._clients):
            stream.cut()
        self._clients.clear()

    def _greet(self, stream: TcpStream) -> None:
        if self._server is None or len(self._clients) >= MOST_CLIENTS:
            stream.cut()
            return
        self._clients[stream] = _TcpClient(stream)

    def _hear(self, stream: TcpStream, data: bytes, now_s: float) -> None:
        client = self._clients.get(stream)
        if client is not None and self.on_data is not None:
            self.on_data(client, data, now_s)

    def _lose(self, stream: TcpStream, reason: str) -> None:
        client = self._clients.pop(stream, None)
        if client is not None and self.on_gone is not None:
            self.on_gone(client)
