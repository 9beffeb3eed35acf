"""Clients over UDP."""

import asyncio
from collections.abc import Callable

from companion.link.clients import MOST_CLIENTS, Client, OnData, cannot_open
from companion.link.udp import datagrams_wait
from companion.link.url import LinkUrl

_FORGOTTEN_AFTER_S = 15.0


class _UdpClient:
    """An address that datagrams came from, or are to go to."""

    def __init__(self, owner: "UdpClients", address: tuple[str, int]) -> None:
        self.address = address
        self.heard_s = asyncio.get_running_loop().time()
        self._owner = owner

    @property
    def name(self) -> str:
        return f"{self.address[0]}:{self.address[1]}"

    def send(self, data: bytes) -> bool:
        return self._owner.send_to(self.address, data)


class UdpClients(asyncio.DatagramProtocol):
    """Clients over UDP: one that is known (`udpout`), or whoever speaks sense (`udpin`)."""

    def __init__(self, url: LinkUrl, makes_sense: Callable[[bytes], bool]) -> None:
        """Prepare.

        Args:
            url: where to send (`udpout`) or to bind (`udpin`).
            makes_sense: decides by a datagram whether its sender is a client.
        """
        self.url = url
        self.on_data: OnData | None = None
        self.on_gone: Callable[[Client], None] | None = None
        self.datagrams = True
        self.local: tuple[str, int] | None = None
        self._makes_sense = makes_sense
        self._transport: asyncio.DatagramTransport | None = None
        self._clients: dict[tuple[str, int], _UdpClient] = {}

    @property
    def description(self) -> str:
        """Where it is, for a person."""
        if self.url.is_server and self.local is not None:
            return str(LinkUrl(self.url.scheme, self.url.host, self.local[1]))
        return str(self.url)

    def present(self) -> list[Client]:
        """Who is there."""
        return list(self._clients.values())

    async def open(self) -> None:
        """Bind or connect the socket.

        Raises:
            LinkError: the host is unknown, or the address is taken or not this computer's.
        """
        loop = asyncio.get_running_loop()
        address = (self.url.host, self.url.port)
        here = self.url.is_server
        try:
            self._transport, _ = await loop.create_datagram_endpoint(
                lambda: self,
                local_addr=address if here else None,
                remote_addr=None if here else address,
            )
        except OSError as error:
            raise cannot_open(self.url, error) from error
        self.local = self._transport.get_extra_info("sockname")[:2]
        if not here:
            peer = self._transport.get_extra_info("peername")[:2]
            self._clients[peer] = _UdpClient(self, peer)

    def send_to(self, address: tuple[str, int], data: bytes) -> bool:
        """Send a datagram, or drop it."""
        transport = self._transport
        if transport is None or datagrams_wait(transport):
            return False
        transport.sendto(data, address if self.url.is_server else None)
        return True

    def tidy(self, now_s: float) -> None:
        """Forget who has not spoken for long."""
        if not self.url.is_server:
            return
        for address, client in list(self._clients.items()):
            if now_s - client.heard_s > _FORGOTTEN_AFTER_S:
                del self._clients[address]
                if self.on_gone is not None:
                    self.on_gone(client)

    def close(self) -> None:
        """Close the socket."""
        if self._transport is not None:
            self._transport.close()
            self._transport = None

    def datagram_received(self, data: bytes, addr: tuple[str | int, ...]) -> None:
        """Called by asyncio."""
        address = (str(addr[0]), int(addr[1]))
        client = self._clients.get(address)
        if client is None:
            if len(self._clients) >= MOST_CLIENTS or not self._makes_sense(data):
                return
            client = self._clients[address] = _UdpClient(self, address)
        client.heard_s = asyncio.get_running_loop().time()
        if self.on_data is not None:
            self.on_data(client, data, client.heard_s)

    def error_received(self, exc: Exception) -> None:
        """Nobody listens there yet, or no longer: it may come back."""
