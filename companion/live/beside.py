"""Starts the page's process beside a flight."""

import json
import os
import secrets
import select
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from companion.extras import install_extra
from companion.live.feed import LiveFeed, datagram_pair

_STARTS_WITHIN_S = 20.0
_TOKEN_BYTES = 16


class LivePageError(Exception):
    """There is no page; the text says why, and the remedy."""


@dataclass(frozen=True, slots=True)
class PageOptions:
    """Where a page is served."""

    host: str = "127.0.0.1"
    port: int = 0
    """0 takes any that is free."""


@dataclass(frozen=True, slots=True)
class LivePage:
    """A page that is served."""

    url: str
    feed: LiveFeed
    """To be set as the log's listener."""


def start_page(configuration: Mapping[str, Any], host: str, port: int) -> LivePage:
    """Serve a page beside the flight that is about to begin in this process.

    Args:
        configuration: the log's record of that name.
        host: address to bind to.
        port: 0 takes any.

    Raises:
        LivePageError: the extra is missing, the address can't be had, or it does not start.
    """
    require_live()
    ours, theirs = datagram_pair()
    with theirs:
        # A session of its own: a terminal's Ctrl-C lands the flight, and the page shows it.
        process = subprocess.Popen(
            [sys.executable, "-m", "companion.live"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            pass_fds=[theirs.fileno()],
            start_new_session=True,
        )
        told = {
            "feed": theirs.fileno(),
            "host": host,
            "port": port,
            "token": secrets.token_urlsafe(_TOKEN_BYTES),
            "flight_pid": os.getpid(),
            "configuration": configuration,
        }
        assert process.stdin is not None
        try:
            with process.stdin as stdin:
                stdin.write(json.dumps(told).encode() + b"\n")
        except OSError:
            pass  # it has died; why is not known, and said below
    said = _first_line(process)
    if "url" not in said:
        ours.close()
        process.kill()
        process.wait()
        why = said.get("error", "it does not start")
        raise LivePageError(
            f"The live page can't be served at {host}:{port} ({why}). Choose another --live-port "
            "or --live-host, or fly without --live."
        )
    return LivePage(said["url"], LiveFeed(ours))


def require_live() -> None:
    """Look whether the libraries are there.

    Raises:
        LivePageError: they are not.
    """
    from importlib.util import find_spec

    missing = [name for name in ("starlette", "uvicorn", "websockets") if find_spec(name) is None]
    if missing:
        raise LivePageError(f"The live page needs {', '.join(missing)}: {install_extra('live')}")


def _first_line(process: "subprocess.Popen[bytes]") -> dict[str, str]:
    assert process.stdout is not None
    with process.stdout as stdout:
        if not select.select([stdout], [], [], _STARTS_WITHIN_S)[0]:
            return {"error": f"not ready within {_STARTS_WITHIN_S:g} s"}
        line = stdout.readline()
    if not line:
        return {}
    said: dict[str, str] = json.loads(line)
    return said
