"""The page's web server: what is known of a flight, to whoever looks on.

Frames are for whoever keeps up: each browser is sent the newest one when it has taken the one
before.  Everything else (messages, what changed of the flight, its end) is sent whole, in order.
"""

import asyncio
import contextlib
from collections import deque
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

import orjson
from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from companion.live.access import POLICY, Access
from companion.live.watching import Watched

STATIC = Path(__file__).parent / "static"
_COMMANDS = ("land", "abort")
_LARGEST_REQUEST_BYTES = 1024
_MOST_WAITING = 2000
_FOREIGN = "This page is shown under the address that companion printed, and no other."

Command = Callable[[str], Awaitable[str]]
"""Gives a command to the flight; its answer.  Raises CommandSocketError."""


class CommandError(Exception):
    """The flight can't be reached, or takes no command; the text says why."""


class Viewer:
    """One browser: what waits for it."""

    def __init__(self) -> None:
        self._waiting: deque[bytes] = deque(maxlen=_MOST_WAITING)
        self._frame: bytes | None = None
        self._there = asyncio.Event()

    def tell(self, data: bytes) -> None:
        """Something that it must have."""
        self._waiting.append(data)
        self._there.set()

    def show(self, frame: bytes) -> None:
        """A frame, in place of one that it has not taken yet."""
        self._frame = frame
        self._there.set()

    async def next(self) -> list[bytes]:
        """Wait for what is to be sent."""
        await self._there.wait()
        self._there.clear()
        due = list(self._waiting)
        self._waiting.clear()
        if self._frame is not None:
            due.append(self._frame)
            self._frame = None
        return due


class Pages:
    """All browsers that look at one flight."""

    def __init__(self, watched: Watched, access: Access, command: Command | None) -> None:
        """Take a flight.

        Args:
            watched: the flight.
            access: the rules.
            command: gives commands to the flight; None for a recorded one.
        """
        self.watched = watched
        self.viewers: set[Viewer] = set()
        self._access = access
        self._command = command
        self._end: bytes | None = None

    def app(self) -> Starlette:
        """The web application."""
        return Starlette(
            routes=[
                Route("/", self._page),
                Route("/api/flight", self._flight),
                Route("/api/history", self._history),
                Route("/api/command", self._on_command, methods=["POST"]),
                WebSocketRoute("/ws", self._live),
                Mount("/static", StaticFiles(directory=STATIC)),
            ],
            middleware=[Middleware(_Guarded, access=self._access)],
        )

    # --- what there is to see ---

    def show(self, frame: Mapping[str, Any]) -> None:
        """A new Frame; before it, what has changed of the flight."""
        if self.watched.flight_changed:
            self.watched.flight_changed = False
            self._tell({"type": "flight", **self.watched.flight})
        data = _json({"type": "frame", **frame})
        for viewer in self.viewers:
            viewer.show(data)

    def say(self, message: Mapping[str, Any]) -> None:
        """A new Message."""
        self._tell({"type": "message", **message})

    def end(self, result: Mapping[str, Any]) -> None:
        """The flight is over."""
        self._end = _json({"type": "end", **result})
        self._tell({"type": "flight", **self.watched.flight})
        for viewer in self.viewers:
            viewer.tell(self._end)

    def _tell(self, item: Mapping[str, Any]) -> None:
        data = _json(item)
        for viewer in self.viewers:
            viewer.tell(data)

    # --- requests ---

    async def _page(self, _: Request) -> Response:
        return FileResponse(STATIC / "index.html")

    async def _flight(self, _: Request) -> Response:
        return _answer(self.watched.flight)

    async def _history(self, _: Request) -> Response:
        watched = self.watched
        return _answer({"frames": watched.frames, "messages": watched.messages})

    async def _on_command(self, request: Request) -> Response:
        if not self._access.may_command(request.headers):
            return _answer({"error": "the token is not the one that companion printed"}, 403)
        if not request.headers.get("content-type", "").startswith("application/json"):
            return _answer({"error": "send application/json"}, 422)
        asked = await _body(request)
        name = asked.get("command") if isinstance(asked, dict) else None
        if name not in _COMMANDS:
            return _answer({"error": f"not a command; there are {', '.join(_COMMANDS)}"}, 422)
        if self._command is None or self._end is not None:
            return _answer({"error": "this flight is over"}, 409)
        try:
            return _answer({"answer": await self._command(name)})
        except CommandError as error:
            return _answer({"error": str(error)}, 409)

    async def _live(self, socket: WebSocket) -> None:
        if self._command is None:
            await socket.close(1008)
            return
        await socket.accept()
        viewer = Viewer()
        viewer.tell(_json({"type": "flight", **self.watched.flight}))
        if self._end is not None:
            viewer.tell(self._end)
        self.viewers.add(viewer)
        sending = asyncio.create_task(_send_all(viewer, socket))
        try:
            while (await socket.receive())["type"] != "websocket.disconnect":
                pass  # a page has nothing to say here
        finally:
            self.viewers.discard(viewer)
            sending.cancel()
            with contextlib.suppress(asyncio.CancelledError, Exception):
                await sending


async def _send_all(viewer: Viewer, socket: WebSocket) -> None:
    while True:
        for data in await viewer.next():
            await socket.send_text(data.decode())


async def _body(request: Request) -> object:
    """The request's JSON; None if it is none, or too long."""
    data = b""
    async for piece in request.stream():
        data += piece
        if len(data) > _LARGEST_REQUEST_BYTES:
            return None
    try:
        read: object = orjson.loads(data)
    except ValueError:
        return None
    return read


class _Guarded:
    """Turns away what does not come by this server's own address, and sets the policy."""

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app = app
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        access = self._access
        if not (access.host_allowed(headers) and access.origin_allowed(headers)):
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008})
                return
            await PlainTextResponse(_FOREIGN, 403)(scope, receive, send)
            return

        async def with_policy(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [
                    *message["headers"],
                    (b"content-security-policy", POLICY.encode()),
                    (b"x-content-type-options", b"nosniff"),
                    (b"referrer-policy", b"no-referrer"),
                    (b"cache-control", b"no-cache"),
                ]
            await send(message)

        await self._app(scope, receive, with_policy)


def _json(item: Mapping[str, Any]) -> bytes:
    return orjson.dumps(item, default=str)


def _answer(item: Mapping[str, Any], status: int = 200) -> Response:
    return Response(_json(item), status, media_type="application/json")
