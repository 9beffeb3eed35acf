"""Runs the page's server until the flight is over and nobody looks any more."""

import asyncio
import base64
import contextlib
import socket
from collections.abc import Callable
from typing import Any

import orjson
import uvicorn

from companion.flight.command_socket import CommandSocketError, send_command
from companion.flight.inbox import PilotCommand
from companion.live.access import Access, is_loopback
from companion.live.feed import END, PACKET, RECORD
from companion.live.scene import short_result
from companion.live.server import CommandError, Pages
from companion.live.watching import Watched

_LARGEST_DATAGRAM = 1 << 21
_FEED_BYTES = 1 << 20
LONGEST_AFTER_S = 600.0
"""After the flight the page stays for as long as a browser shows it, at most this long."""
_GRACE_S = 15.0
"""So long it waits for a browser that connects again."""
_LOOK_S = 1.0
_ALL = ("0.0.0.0", "::")


def bound_socket(host: str, port: int) -> socket.socket:
    """A listening socket.

    Raises:
        OSError: the address can't be had.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((host, port))
        listening.listen(64)
    except OSError:
        listening.close()
        raise
    return listening


def page_access(listening: socket.socket, host: str, token: str) -> Access:
    """The rules of a server: beyond loopback, by the names that the network has for us."""
    names: tuple[str, ...] = ()
    if not is_loopback(host):
        name = socket.gethostname().lower()
        names = (name, f"{name}.local")
    return Access(host.lower(), listening.getsockname()[1], token, names)


def page_url(access: Access, *, commands: bool) -> str:
    """The address of the page; with the token, if it gives commands."""
    host = access.host if access.host not in _ALL else access.names[0]
    host = f"[{host}]" if ":" in host else host
    return f"http://{host}:{access.port}/" + (f"#token={access.token}" if commands else "")


async def serve_recorded(watched: Watched, access: Access, listening: socket.socket) -> None:
    """Serve a recorded flight until a signal ends it."""
    pages = Pages(watched, access, None)
    await _server(pages).serve(sockets=[listening])


async def serve_live(
    watched: Watched,
    access: Access,
    listening: socket.socket,
    feed: socket.socket,
    flight_pid: int,
) -> None:
    """Serve a flight that comes by the feed, until it is over and nobody looks any more."""

    async def command(name: str) -> str:
        try:
            return await send_command(PilotCommand(name), flight_pid)
        except CommandSocketError as error:
            raise CommandError(str(error)) from error

    pages = Pages(watched, access, command)
    server = _server(pages)
    over = asyncio.Event()
    loop = asyncio.get_running_loop()
    feed.setblocking(False)
    with contextlib.suppress(OSError):
        feed.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _FEED_BYTES)
    follower = _Follower(pages, over.set)
    loop.add_reader(feed, follower.read, feed)

    async def ending() -> None:
        await over.wait()
        loop.remove_reader(feed)
        until_s = loop.time() + LONGEST_AFTER_S
        alone_s = 0.0
        while loop.time() < until_s and alone_s < _GRACE_S:
            await asyncio.sleep(_LOOK_S)
            alone_s = 0.0 if pages.viewers else alone_s + _LOOK_S
        server.should_exit = True

    end = asyncio.create_task(ending())
    try:
        await server.serve(sockets=[listening])
    finally:
        end.cancel()


class _Follower:
    """Reads the feed, and shows what comes."""

    def __init__(self, pages: Pages, on_over: Callable[[], None]) -> None:
        self._pages = pages
        self._on_over = on_over
        self._ended = False

    def read(self, feed: socket.socket) -> None:
        """Take what is there."""
        try:
            data = feed.recv(_LARGEST_DATAGRAM)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            if not self._ended:
                self._end({"outcome": "lost", "note": "the flight's process has ended"}, None)
            self._on_over()
            return
        self._take(orjson.loads(data))

    def _take(self, items: list[list[Any]]) -> None:
        pages, watched = self._pages, self._pages.watched
        newest_s: float | None = None
        for kind, time_s, *rest in items:
            newest_s = time_s if newest_s is None else max(newest_s, time_s)
            if kind == END:
                self._end(short_result(rest[0]), time_s)
            elif kind == PACKET:
                watched.take((PACKET, time_s, base64.b64decode(rest[0]), None))
            else:
                message = watched.take((RECORD, time_s, rest[0], rest[1]))
                if message is not None:
                    pages.say(message)
        if newest_s is not None and not self._ended:
            pages.show(watched.look(newest_s))

    def _end(self, result: dict[str, Any], time_s: float | None) -> None:
        self._ended = True
        self._pages.watched.end(result, time_s)
        self._pages.end(result)


def _server(pages: Pages) -> uvicorn.Server:
    return uvicorn.Server(
        uvicorn.Config(
            pages.app(),
            log_level="error",
            access_log=False,
            lifespan="off",
            ws="websockets-sansio",
            timeout_graceful_shutdown=1,
        )
    )
