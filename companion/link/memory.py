"""A link in memory, for flights in lockstep: the same bytes, no sockets."""

import asyncio
from collections.abc import Callable

from companion.link.link import LinkCounters, OnBytes, OnChange


class MemoryLink:
    """One end of a byte pipe; whoever builds it says where its bytes go."""

    def __init__(self, deliver: Callable[[bytes], None], description: str = "memory") -> None:
        """Make an end.

        Args:
            deliver: takes what is sent; called during `send`.
            description: where it leads, for a person.
        """
        self.counters = LinkCounters()
        self.on_bytes: OnBytes | None = None
        self.on_change: OnChange | None = None
        self.down_because = ""
        self.datagrams = True
        self.speaks_first = False
        self.description = description
        self._deliver = deliver
        self._time: Callable[[], float] | None = None

    async def open(self) -> None:
        """Begin to pass bytes on."""
        self._time = asyncio.get_running_loop().time

    def send(self, data: bytes) -> None:
        """Hand bytes to the other side."""
        if self._time is None:
            self.counters.unsent_packets += 1
            return
        self.counters.packets_out += 1
        self.counters.bytes_out += len(data)
        self._deliver(data)

    def receive(self, data: bytes) -> None:
        """Take bytes from the other side, now; they are lost while this end is not open."""
        if self._time is None:
            self.counters.foreign_packets += 1
            return
        self.counters.packets_in += 1
        self.counters.bytes_in += len(data)
        if self.on_bytes is not None:
            self.on_bytes(data, self._time())

    def close(self) -> None:
        """Stop passing bytes on."""
        self._time = None
