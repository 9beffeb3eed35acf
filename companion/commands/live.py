"""What ``companion live`` does: serve the page of a recorded flight."""

import asyncio
import contextlib
import secrets
import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from companion.live.beside import LivePageError, PageOptions, require_live
from companion.live.watching import RecordedFlightError, watch_recorded


class BadInputError(Exception):
    """What was asked for can't be shown; the text says why, and the remedy."""


@dataclass(frozen=True, slots=True)
class LiveRequest:
    """The options of the command line."""

    log: Path
    page: PageOptions


def run_live(request: LiveRequest) -> None:
    """Serve the page until Ctrl-C.

    Raises:
        BadInputError: there is no such log, or no page.
    """
    console = Console(file=sys.stderr, highlight=False)
    try:
        require_live()
        from companion.live.serving import bound_socket, page_access, page_url, serve_recorded

        watched = watch_recorded(request.log)
        listening = bound_socket(request.page.host, request.page.port)
    except (LivePageError, RecordedFlightError) as error:
        raise BadInputError(str(error)) from error
    except OSError as error:
        raise BadInputError(
            f"{request.page.host}:{request.page.port} can't be had ({error.strerror or error}). "
            "Choose another --port or --host."
        ) from error
    access = page_access(listening, request.page.host, secrets.token_urlsafe())
    console.print(watched.flight["title"], soft_wrap=True)
    console.print(f"page: {page_url(access, commands=False)}", soft_wrap=True)
    console.print("Ctrl-C ends it.", style="dim")
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(serve_recorded(watched, access, listening))
