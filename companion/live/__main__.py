"""The page's process beside a flight; `companion.live.beside` starts it and says what it shows.

It reads one line of JSON from its standard input, writes one with the page's address (or with why
there is none) to its standard output, and serves.
"""

import asyncio
import contextlib
import json
import os
import signal
import socket
import sys

from companion.live.serving import bound_socket, page_access, page_url, serve_live
from companion.live.watching import Watched

_NICE = 10
"""The flight comes first."""


def _run() -> None:
    told = json.loads(sys.stdin.readline())
    with contextlib.suppress(OSError):
        os.nice(_NICE)
    # Who presses Ctrl-C wants the vehicle to land, and to see it land.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    feed = socket.socket(fileno=told["feed"])
    try:
        listening = bound_socket(told["host"], told["port"])
    except OSError as error:
        _answer({"error": error.strerror or str(error)})
        return
    access = page_access(listening, told["host"], told["token"])
    watched = Watched(told["configuration"], "live")
    _answer({"url": page_url(access, commands=True)})
    asyncio.run(serve_live(watched, access, listening, feed, told["flight_pid"]))


def _answer(said: dict[str, str]) -> None:
    sys.stdout.write(json.dumps(said) + "\n")
    sys.stdout.flush()
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, sys.stdout.fileno())


if __name__ == "__main__":
    _run()
