"""The shim on UDP: one socket per link, with PX4's ports by default.

PX4 speaks first, to a default port of the client's; the first datagram that comes in fixes the
client's address for good.
"""

import asyncio
import contextlib
import errno
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import cast

from sitl_shim.driver import LoopDriver, faults_on_links
from sitl_shim.mavlink.endpoint import Shim
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.sensors.camera import CameraOptions, MocapCamera
from sitl_shim.simulation import ShimOptions

GROUND_STATION_PORT, GROUND_STATION_REMOTE = 18570, 14550
ONBOARD_PORT, ONBOARD_REMOTE = 14580, 14540
LOOPBACK = "127.0.0.1"
_MOST_UNREAD_BYTES = 1_000_000
"""A TCP client that reads no more than this loses what comes after."""

Address = tuple[str, int]


class PortError(OSError):
    """A port cannot be bound; the text says which, why, and what to do."""


@dataclass(frozen=True, slots=True)
class UdpLink:
    """One link over UDP."""

    kind: LinkKind
    port: int
    """To bind; 0 takes any free one."""
    remote_port: int
    """Where to speak until a client has spoken."""


@dataclass(frozen=True, slots=True)
class TcpServer:
    """One link over TCP, to which one client at a time connects, as to ArduPilot's simulation."""

    kind: LinkKind
    port: int
    """To bind; 0 takes any free one."""


@dataclass(frozen=True, slots=True)
class BoundLink:
    """A link whose socket is open."""

    kind: LinkKind
    local: Address
    remote: Address


def default_links(instance: int = 0) -> tuple[UdpLink, UdpLink]:
    """PX4's two links: the ground station's and the onboard one."""
    return (
        UdpLink(LinkKind.GROUND_STATION, GROUND_STATION_PORT + instance, GROUND_STATION_REMOTE),
        UdpLink(LinkKind.ONBOARD, ONBOARD_PORT + instance, ONBOARD_REMOTE + instance),
    )


class _Endpoint(asyncio.DatagramProtocol):
    """One socket, which latches onto its first peer."""

    def __init__(self, remote: Address, receive: Callable[[bytes], None]) -> None:
        self._remote = remote
        self._receive = receive
        self._latched = False
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        # Not isinstance: the loop's own datagram transport is no subclass before Python 3.12.
        self._transport = cast("asyncio.DatagramTransport", transport)

    def datagram_received(self, data: bytes, addr: Address) -> None:
        if not self._latched:
            self._latched = True
            self._remote = addr
        self._receive(data)

    def error_received(self, exc: Exception) -> None:
        """Nobody listens yet: PX4 does not mind either."""

    def send(self, data: bytes) -> None:
        if self._transport is not None:
            self._transport.sendto(data, self._remote)


class _TcpEndpoint(asyncio.Protocol):
    """The connections of one TCP link: the newest client takes the place of the one before."""

    def __init__(self, receive: Callable[[bytes], None], clients: list[asyncio.Transport]) -> None:
        self._receive = receive
        self._clients = clients

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        for other in self._clients:
            other.abort()
        self._clients[:] = [cast("asyncio.Transport", transport)]

    def data_received(self, data: bytes) -> None:
        self._receive(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._clients[:] = [client for client in self._clients if not client.is_closing()]


class _TcpSender:
    """Sends to whoever is connected."""

    def __init__(self, clients: list[asyncio.Transport]) -> None:
        self._clients = clients

    def send(self, data: bytes) -> None:
        for client in self._clients:
            if client.get_write_buffer_size() < _MOST_UNREAD_BYTES:
                client.write(data)


async def serve(
    options: ShimOptions,
    links: Sequence[UdpLink | TcpServer],
    *,
    host: str = LOOPBACK,
    ready: Callable[[Sequence[BoundLink]], None] = lambda _: None,
    rejected: Callable[[Mapping[str, int]], None] = lambda _: None,
    mocap_port: int | None = None,
) -> None:
    """Fly until cancelled, answering over UDP.

    Args:
        options: what is simulated.
        links: the links to open.
        host: address to bind, and to speak to until a client has spoken.
        ready: called once with the open links, before the first datagram leaves.
        mocap_port: where the room's motion capture sends its poses, on `host`; None: nowhere.
        rejected: called at the end with the packets not read for their signatures, by the reason.

    Raises:
        ValueError: an unknown vehicle, scenario, flavour or parameter, or faults that are none.
        PortError: a port is taken or may not be bound.
    """
    loop = asyncio.get_running_loop()
    # Stamps of signatures follow the calendar, at whatever speed simulated time goes, and so grow
    # over restarts; the loop's clock carries them on, since that one is never set back.
    epoch_unix_s = time.time() - loop.time()
    shim = Shim(options, [link.kind for link in links], unix_s=lambda: epoch_unix_s + loop.time())
    endpoints: list[_Endpoint | _TcpSender] = []
    async with contextlib.AsyncExitStack() as stack:
        room = None
        if mocap_port is not None:
            cameras, _ = await loop.create_datagram_endpoint(
                asyncio.DatagramProtocol, remote_addr=(host, mocap_port)
            )
            stack.callback(cameras.close)
            room = (MocapCamera(CameraOptions(), seed=options.seed), cameras.sendto)
        driver = LoopDriver(
            shim,
            speed=options.speed,
            deliver=lambda index, data: endpoints[index].send(data),
            room=room,
            faults=faults_on_links(shim, options, len(links)),
        )
        bound: list[BoundLink] = []
        for index, link in enumerate(links):
            if isinstance(link, TcpServer):
                server, sender = await _listen(loop, host, link, driver, index)
                stack.callback(server.close)
                endpoints.append(sender)
                local = server.sockets[0].getsockname()
                bound.append(BoundLink(link.kind, (local[0], local[1]), (local[0], local[1])))
                continue
            remote = (host, link.remote_port)
            transport, endpoint = await _open(loop, host, link, remote, driver, index)
            stack.callback(transport.close)
            endpoints.append(endpoint)
            local = transport.get_extra_info("sockname")
            bound.append(BoundLink(link.kind, (local[0], local[1]), remote))
        ready(bound)
        stack.callback(lambda: rejected(shim.signing.rejected))
        await driver.run()


async def _open(
    loop: asyncio.AbstractEventLoop,
    host: str,
    link: UdpLink,
    remote: Address,
    driver: LoopDriver,
    index: int,
) -> tuple[asyncio.DatagramTransport, _Endpoint]:
    try:
        return await loop.create_datagram_endpoint(
            lambda: _Endpoint(remote, lambda data: driver.receive(index, data)),
            local_addr=(host, link.port),
        )
    except OSError as error:
        what = f"UDP port {link.port} on {host} (the {link.kind.value} link)"
        raise _port_error(what, error) from error


async def _listen(
    loop: asyncio.AbstractEventLoop, host: str, link: TcpServer, driver: LoopDriver, index: int
) -> tuple[asyncio.Server, _TcpSender]:
    clients: list[asyncio.Transport] = []
    try:
        server = await loop.create_server(
            lambda: _TcpEndpoint(lambda data: driver.receive(index, data), clients),
            host,
            link.port,
        )
    except OSError as error:
        raise _port_error(f"TCP port {link.port} on {host}", error) from error
    return server, _TcpSender(clients)


def _port_error(what: str, error: OSError) -> PortError:
    if error.errno == errno.EADDRINUSE:
        reason = (
            f"{what} is in use: another autopilot or shim is running. Stop it, or choose"
            " other ports (--instance, or the link's port option; 0 takes a free one)"
        )
    else:
        reason = f"{what} cannot be bound: {error.strerror or error}"
    return PortError(error.errno, reason)
