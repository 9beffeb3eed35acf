"""A server that speaks the page's contract and does what a test asks of it."""

import asyncio
import contextlib
import json
import queue
import socket
import threading
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.responses import FileResponse, JSONResponse
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles

import companion
from tests.browser import fake_flight

STATIC = Path(companion.__file__).parent / "live" / "static"
POLICY = {"Content-Security-Policy": "default-src 'self'"}
TOKEN = "a-token-for-tests"


class PageServer:
    """Serves the page on loopback from a thread of its own; what it sends is the test's."""

    def __init__(self, flight, history=(), messages=(), port=0):
        self.flight = flight
        self.history = list(history)
        self.messages = list(messages)
        self.commands = queue.Queue()
        self.answer = (200, {"answer": "land: taken"})
        self.clients = set()
        self.joined = threading.Semaphore(0)
        self.socket = socket.create_server(("127.0.0.1", port))
        self.port = self.socket.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}/"
        self.loop = asyncio.new_event_loop()
        self.server = uvicorn.Server(
            uvicorn.Config(self._app(), log_level="error", lifespan="off", ws="websockets-sansio")
        )
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def send(self, kind, **item):
        """To every page."""
        text = json.dumps({"type": kind, **item})

        async def each():
            for client in set(self.clients):
                with contextlib.suppress(Exception):
                    await client.send_text(text)

        asyncio.run_coroutine_threadsafe(each(), self.loop).result(10)

    def send_frames(self, frames):
        for frame in frames:
            self.send("frame", **frame)

    def stop(self):
        self.server.should_exit = True
        self.server.force_exit = True
        self.thread.join(10)
        self.socket.close()

    def _run(self):
        asyncio.set_event_loop(self.loop)
        self.loop.run_until_complete(self.server.serve(sockets=[self.socket]))

    def _app(self):
        async def page(request):
            return FileResponse(STATIC / "index.html", headers=POLICY)

        async def flight(request):
            return JSONResponse(self.flight)

        async def history(request):
            return JSONResponse({"frames": self.history, "messages": self.messages})

        async def command(request):
            said = {"token": request.headers.get("x-companion-token"), **await request.json()}
            self.commands.put(said)
            status, body = self.answer
            return JSONResponse(body, status_code=status)

        async def live(socket):
            await socket.accept()
            await socket.send_text(json.dumps({"type": "flight", **self.flight}))
            self.clients.add(socket)
            self.joined.release()
            with contextlib.suppress(Exception):
                while (await socket.receive())["type"] != "websocket.disconnect":
                    pass
            self.clients.discard(socket)

        return Starlette(
            routes=[
                Route("/", page),
                Route("/api/flight", flight),
                Route("/api/history", history),
                Route("/api/command", command, methods=["POST"]),
                WebSocketRoute("/ws", live),
                Mount("/static", StaticFiles(directory=STATIC)),
            ]
        )


def recorded():
    """A server with the whole invented flight."""
    return PageServer(
        fake_flight.flight("recorded", commands=False, ended=True),
        fake_flight.frames(),
        fake_flight.MESSAGES,
    )


def live(until_s=10.0, port=0):
    """A server in the midst of the invented flight."""
    messages = [m for m in fake_flight.MESSAGES if m["t"] <= until_s]
    return PageServer(fake_flight.flight(), fake_flight.frames(until_s), messages, port)
