"""MAVLink over UDP.

`udpin` binds and waits: the first sender of what its owner accepts becomes the peer, and from then
on datagrams of anybody else are dropped before they are looked at.  Only if the peer has fallen
silent may the same host go on from another port: an autopilot that has restarted often does.
`udpout` knows its peer from the start; the system itself then drops what others send.

All that waits in the system is read at once, and the peer's is passed on in one piece: else a
flood, or a stall of this process, would leave a queue of old states there.
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
_MOST_AT_ONCE = 1024
"""Datagrams that are read before the loop sees to something else: a millisecond or two."""
_LARGEST_DATAGRAM = 65_536
_TURN_S = 0.02
_MOST_INTRODUCTIONS = 50
"""Datagrams of strangers that are looked through for a vehicle's heartbeat in a turn."""
_LONGEST_INTRODUCTION = 2048
"""Bytes; autopilots send datagrams that fit a network's frame."""

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
        self.speaks_first = url.scheme == "udpout"
        self.peer: Address | None = None
        """Who the peer is; None while `udpin` waits for it."""
        self.local: Address | None = None
        """Where the socket is bound: the port that was free, if 0 was asked for."""
        self._accept_peer = accept_peer
        self._heard_s = -math.inf
        self._turn_s = -math.inf
        self._introductions = 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._socket: socket.socket | None = None

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
        family, address = await self._resolve(loop, passive=inward)
        made = socket.socket(family, socket.SOCK_DGRAM)
        try:
            made.setblocking(False)
            if inward:
                made.bind(address)
            else:
                made.connect(address)
        except OSError as error:
            made.close()
            raise LinkError(self._why_not(error)) from error
        with contextlib.suppress(OSError):
            # The system may grant less; then less it is.
            made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
        self._loop, self._socket = loop, made
        self.local = made.getsockname()[:2]
        if not inward:
            self.peer = address[:2]
            self.counters.connections += 1
        loop.add_reader(made.fileno(), self._read)

    def send(self, data: bytes) -> None:
        """Send one datagram to the peer; dropped and counted if there is none, or it must wait."""
        sock = self._socket
        if sock is None or self.peer is None:
            self.counters.unsent_packets += 1
            return
        try:
            if self.url.scheme == "udpout":
                sock.send(data)
            else:
                sock.sendto(data, self.peer)
        except (BlockingIOError, InterruptedError):
            self.counters.unsent_packets += 1
        except OSError:
            # Also ICMP "port unreachable" of an earlier one: nobody listens yet, or no longer.
            self.counters.errors += 1
            self.counters.unsent_packets += 1
        else:
            self.counters.packets_out += 1
            self.counters.bytes_out += len(data)

    def close(self) -> None:
        """Close the socket."""
        sock, self._socket = self._socket, None
        if sock is not None:
            if self._loop is not None:
                self._loop.remove_reader(sock.fileno())
            sock.close()

    def take(self, data: bytes, sender: Address, now_s: float) -> None:
        """Take a datagram from the socket: drop a stranger's, pass the peer's on."""
        if self._is_peers(data, sender, now_s):
            self._pass_on([data], now_s)

    def _read(self) -> None:
        """Read what waits, up to a limit; what is left makes the loop call again."""
        sock, loop = self._socket, self._loop
        if sock is None or loop is None:
            return
        now_s = loop.time()
        peers: list[bytes] = []
        for _ in range(_MOST_AT_ONCE):
            try:
                data, sender = sock.recvfrom(_LARGEST_DATAGRAM)
            except (BlockingIOError, InterruptedError):
                break
            except OSError:
                self.counters.errors += 1
                continue
            if self._is_peers(data, sender[:2], now_s):
                peers.append(data)
        if peers:
            self._pass_on(peers, now_s)

    def _is_peers(self, data: bytes, sender: Address, now_s: float) -> bool:
        """Whether a datagram is the peer's; one of a stranger may make him the peer."""
        if sender != self.peer:
            if not self._may_be_peer(sender, now_s) or not self._introduces(data, now_s):
                self.counters.foreign_packets += 1
                return False
            self._take_for_peer(sender)
        self._heard_s = now_s
        return True

    def _pass_on(self, datagrams: list[bytes], now_s: float) -> None:
        """Give datagrams on as one: a packet that one of them cuts off swallows none behind it."""
        self.counters.packets_in += len(datagrams)
        data = datagrams[0] if len(datagrams) == 1 else b"".join(datagrams)
        self.counters.bytes_in += len(data)
        if self.on_bytes is not None:
            self.on_bytes(data, now_s)

    def _introduces(self, data: bytes, now_s: float) -> bool:
        """Look through a stranger's datagram, if strangers have not had their share of the turn."""
        if now_s - self._turn_s >= _TURN_S:
            self._turn_s, self._introductions = now_s, 0
        self._introductions += 1
        if self._introductions > _MOST_INTRODUCTIONS or len(data) > _LONGEST_INTRODUCTION:
            return False
        return self._accept_peer(data)

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

    async def _resolve(
        self, loop: asyncio.AbstractEventLoop, *, passive: bool
    ) -> tuple[int, tuple[str, int]]:
        """Family and address of the host."""
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
        return found[0][0], (str(host), int(port))

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


def datagrams_wait(transport: asyncio.DatagramTransport) -> bool:
    """True while the system takes no more: asyncio would keep datagrams without bound."""
    return bool(transport.get_write_buffer_size())  # type: ignore[attr-defined] # typeshed lacks it
