"""MAVLink over UDP.

`udpin` binds and waits: the first sender of what its owner accepts becomes the peer, and from then
on datagrams of anybody else are dropped before they are looked at.  Only if the peer has fallen
silent may the same host go on from another port: an autopilot that has restarted often does.
`udpout` knows its peer from the start; the system itself then drops what others send.
"""

import asyncio
import contextlib
import math
import socket
from collections.abc import Callable

from companion.link.link import LinkCounters, LinkError, OnBytes, OnChange
from companion.link.reconnection import SILENT_AFTER_S
from companion.link.url import LinkUrl

_RECEIVE_BUFFER = 4 << 20
"""Bytes that may wait while this process cannot run: seconds of telemetry."""

Address = tuple[str, int]


class UdpLink:
    """One UDP socket with one peer, for either direction of the address."""

    def __init__(self, url: LinkUrl, accept_peer: Callable[[bytes], bool]) -> None:
        """Prepare a link; nothing is opened yet.

        Args:
            url: where to bind (`udpin`) or to whom to send (`udpout`).
            accept_peer: for `udpin`, decides by a datagram whether its sender is the peer, for as
                long as the link is open: a stranger taken for it locks the vehicle out.
        """
        self.url = url
        self.counters = LinkCounters()
        self.on_bytes: OnBytes | None = None
        self.on_change: OnChange | None = None
        self.down_because = ""
        self.datagrams = True
        self.peer: Address | None = None
        """Who the peer is; None while `udpin` waits for it."""
        self.local: Address | None = None
        """Where the socket is bound: the port that was free, if 0 was asked for."""
        self._accept_peer = accept_peer
        self._heard_s = -math.inf
        self._transport: asyncio.DatagramTransport | None = None

    @property
    def description(self) -> str:
        """Where it leads, for a person."""
        if self.url.scheme == "udpout" or self.local is None:
            return str(self.url)
        return str(LinkUrl("udpin", self.url.host, self.local[1]))

    async def open(self) -> None:
        """Bind or connect the socket.

        Raises:
            LinkError: the host is unknown, or the address is taken or not this computer's.
        """
        loop = asyncio.get_running_loop()
        inward = self.url.scheme == "udpin"
        address = await self._resolve(loop, passive=inward)
        try:
            transport, _ = await loop.create_datagram_endpoint(
                lambda: _Protocol(self, loop),
                local_addr=address if inward else None,
                remote_addr=None if inward else address,
            )
        except OSError as error:
            raise LinkError(self._why_not(error)) from error
        with contextlib.suppress(OSError):
            # The system may grant less; then less it is.
            transport.get_extra_info("socket").setsockopt(
                socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER
            )
        self._transport = transport
        self.local = transport.get_extra_info("sockname")[:2]
        if not inward:
            self.peer = address
            self.counters.connections += 1

    def send(self, data: bytes) -> None:
        """Send one datagram to the peer; dropped and counted if there is none, or it must wait."""
        transport = self._transport
        if transport is None or self.peer is None or datagrams_wait(transport):
            self.counters.unsent_packets += 1
            return
        self.counters.packets_out += 1
        self.counters.bytes_out += len(data)
        transport.sendto(data, None if self.url.scheme == "udpout" else self.peer)

    def close(self) -> None:
        """Close the socket."""
        if self._transport is not None:
            self._transport.close()
            self._transport = None

    def take(self, data: bytes, sender: Address, now_s: float) -> None:
        """Take a datagram from the socket: drop a stranger's, pass the peer's on."""
        if sender != self.peer:
            if not self._may_be_peer(sender, now_s) or not self._accept_peer(data):
                self.counters.foreign_packets += 1
                return
            self._take_for_peer(sender)
        self._heard_s = now_s
        self.counters.packets_in += 1
        self.counters.bytes_in += len(data)
        if self.on_bytes is not None:
            self.on_bytes(data, now_s)

    def _may_be_peer(self, sender: Address, now_s: float) -> bool:
        if self.peer is None:
            return True
        return sender[0] == self.peer[0] and now_s - self._heard_s > SILENT_AFTER_S

    def _take_for_peer(self, sender: Address) -> None:
        moved = self.peer is not None
        self.peer = sender
        self.counters.connections += 1
        if moved and self.on_change is not None:
            self.on_change("")

    async def _resolve(self, loop: asyncio.AbstractEventLoop, *, passive: bool) -> Address:
        try:
            found = await loop.getaddrinfo(
                self.url.host,
                self.url.port,
                type=socket.SOCK_DGRAM,
                flags=socket.AI_PASSIVE if passive else 0,
            )
        except OSError as error:
            raise LinkError(
                f"The link {self.url} cannot be opened: the host {self.url.host!r} is not known "
                f"({error}). Check the spelling, or give its address in numbers."
            ) from error
        host, port = found[0][4][:2]
        return (str(host), int(port))

    def _why_not(self, error: OSError) -> str:
        if self.url.scheme == "udpout":
            return (
                f"The link {self.url} cannot be opened: {error.strerror or error}. Check that "
                "this computer has a network on which that host can be reached."
            )
        return (
            f"The link {self.url} cannot be opened: {error.strerror or error}. If another "
            f"program (a ground station, another companion) has UDP port {self.url.port}, end "
            "it or choose another port; if the host is not an address of this computer, use "
            "127.0.0.1, or 0.0.0.0 for all of its networks."
        )


class _Protocol(asyncio.DatagramProtocol):
    """What asyncio calls; errors of the network are counted and survived."""

    def __init__(self, link: UdpLink, loop: asyncio.AbstractEventLoop) -> None:
        self._link = link
        self._time = loop.time

    def datagram_received(self, data: bytes, addr: tuple[str | int, ...]) -> None:
        self._link.take(data, addr[:2], self._time())  # type: ignore[arg-type]

    def error_received(self, exc: Exception) -> None:
        # ICMP "port unreachable": nobody listens yet, or no longer. It may come back.
        self._link.counters.errors += 1


def datagrams_wait(transport: asyncio.DatagramTransport) -> bool:
    """True while the system takes no more: asyncio would keep datagrams without bound."""
    return bool(transport.get_write_buffer_size())  # type: ignore[attr-defined] # typeshed lacks it
