"""Endpoints at which several clients use the link: their shape, and what they have in common.

Nothing here waits for a client.  Datagrams and packets that a client does not take are dropped.
"""

from collections.abc import Callable
from typing import Protocol

from companion.link.link import LinkError
from companion.link.tcp_stream import why
from companion.link.url import LinkUrl

MOST_CLIENTS = 8


class Client(Protocol):
    """One program at the other end of an endpoint."""

    @property
    def name(self) -> str:
        """Its address, for a person."""

    def send(self, data: bytes) -> bool:
        """Send whole packets, or drop them; True if they are on their way."""


OnData = Callable[[Client, bytes, float], None]
"""Given what a client says, and the loop's time."""


class Clients(Protocol):
    """An endpoint."""

    on_data: OnData | None
    on_gone: Callable[[Client], None] | None
    datagrams: bool
    local: tuple[str, int] | None
    """Where it is bound, once it is open."""

    @property
    def description(self) -> str:
        """Where it is, for a person."""

    def present(self) -> list[Client]:
        """Who is there."""

    async def open(self) -> None:
        """Make it ready.

        Raises:
            LinkError: it cannot be.
        """

    def tidy(self, now_s: float) -> None:
        """Let go of clients that are gone without a word."""

    def close(self) -> None:
        """End it; safe to call twice."""


def cannot_open(url: LinkUrl, error: OSError) -> LinkError:
    """The error of an endpoint, in words."""
    return LinkError(
        f"The endpoint {url} cannot be opened: {why(error)}. If another program has port "
        f"{url.port}, end it or choose another port; a host must be known, and of this computer "
        "for udpin and tcpin."
    )
