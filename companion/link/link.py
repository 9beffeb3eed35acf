"""The interface of all links, and what they count."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

OnBytes = Callable[[bytes, float], None]
"""Called with received bytes and the loop's time at which they came."""
OnChange = Callable[[str], None]
"""Called when the way to the peer is lost or there (again): why it is down, empty if it is up."""


class LinkError(Exception):
    """A link cannot be made; the text says what, where and the remedy, in one paragraph."""


@dataclass(slots=True)
class LinkCounters:
    """What has passed a link."""

    bytes_in: int = 0
    packets_in: int = 0
    bytes_out: int = 0
    packets_out: int = 0
    foreign_packets: int = 0
    """Dropped: they came from somebody who is not the peer."""
    excess_packets: int = 0
    """Dropped: the peer sent more than there is time for."""
    excess_bytes: int = 0
    """Dropped before they were looked at, for the same reason."""
    unsent_packets: int = 0
    """Dropped: there was nobody to send them to, or too much waits to be sent already."""
    errors: int = 0
    """Errors that the system reported, such as a port that nobody listens on."""
    connections: int = 0
    """How often the way to the peer came about: more than 1 means that it was lost between."""


class Link(Protocol):
    """Carries bytes to and from one peer."""

    counters: LinkCounters
    on_bytes: OnBytes | None
    """Set this before `open`."""
    on_change: OnChange | None
    """Set this before `open`.  What came before a change has no continuation behind it."""
    down_because: str
    """Why nobody can be reached now, for a person; empty while the way is there, or is not known
    to be missing (UDP)."""
    datagrams: bool
    """True if `on_bytes` is given whole datagrams: no packet goes on in the next one."""
    speaks_first: bool
    """True if who is at the other end may be waiting to be spoken to."""

    async def open(self) -> None:
        """Make the link ready.

        Raises:
            LinkError: it cannot be.
        """

    def send(self, data: bytes) -> None:
        """Send bytes, never waiting and never raising for what the network does."""

    def close(self) -> None:
        """End the link; safe to call twice."""

    @property
    def description(self) -> str:
        """Where it leads, for a person."""
