"""The shim that a client meets: fast enough for a test, slow enough for a client's own timers."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from pymavlink.dialects.v20 import all as dialect

from tests.sitl_shim.server.shim_process import free_port, running_shim

_SPEED = 4.0
_ARDUPILOT_BOOT = 0.2


@asynccontextmanager
async def shim_for_clients(flavour: str, seed: int = 1) -> AsyncIterator[tuple[int, int]]:
    """A running shim; the ports to which its onboard and its ground station's link speak."""
    onboard, ground = free_port(), free_port()
    arguments = [
        f"--autopilot={flavour}",
        "--vehicle=bebop2",
        f"--seed={seed}",
        f"--speed={_SPEED}",
        "--onboard-port=0",
        "--gcs-port=0",
        f"--onboard-remote={onboard}",
        f"--gcs-remote={ground}",
    ]
    if flavour == "ardupilot":
        arguments.append(f"--boot-scale={_ARDUPILOT_BOOT}")
    async with running_shim(*arguments):
        yield onboard, ground


class _Listener(asyncio.DatagramProtocol):
    """Asks for parameter 0 at the first datagram, and hears how many there are."""

    def __init__(self) -> None:
        self.count: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        self._mavlink = dialect.MAVLink(None, srcSystem=254, srcComponent=190)
        self._mavlink.robust_parsing = True

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = transport

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        for message in self._mavlink.parse_buffer(data) or ():
            if message.get_type() == "HEARTBEAT":
                request = dialect.MAVLink_param_request_read_message(1, 1, b"", 0)
                self._transport.sendto(request.pack(self._mavlink), addr)
            elif message.get_type() == "PARAM_VALUE" and not self.count.done():
                self.count.set_result(int(message.param_count))


async def announced_parameters(port: int) -> int:
    """How many parameters the vehicle says that it has, by its other link."""
    transport, listener = await asyncio.get_running_loop().create_datagram_endpoint(
        _Listener, local_addr=("127.0.0.1", port)
    )
    try:
        return await listener.count
    finally:
        transport.close()
