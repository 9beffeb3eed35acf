"""The shim over TCP: one client at a time, the newest one."""

import asyncio
import contextlib
from collections.abc import AsyncIterator

import pytest

from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Packer, Parser, dialect
from sitl_shim.server import BoundLink, PortError, TcpServer, serve
from sitl_shim.simulation import ShimOptions

_OPTIONS = ShimOptions(autopilot="ardupilot", vehicle="arducopter", speed=10.0, boot_scale=0.1)


@contextlib.asynccontextmanager
async def _serving(port: int) -> AsyncIterator[BoundLink]:
    bound: asyncio.Future[BoundLink] = asyncio.get_running_loop().create_future()
    links = [TcpServer(LinkKind.ONBOARD, port)]
    task = asyncio.ensure_future(
        serve(_OPTIONS, links, ready=lambda ready: bound.set_result(ready[0]))
    )
    done, _ = await asyncio.wait({task, bound}, return_when=asyncio.FIRST_COMPLETED)
    if task in done:
        task.result()
    try:
        yield bound.result()
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


async def _hears(reader: asyncio.StreamReader, name: str) -> None:
    parser = Parser()
    async with asyncio.timeout(20.0):
        while data := await reader.read(4096):
            if name in [message.get_type() for message in parser.parse(data)]:
                return
    raise AssertionError(f"closed without {name}")


async def test_a_client_is_answered_and_the_next_one_takes_its_place() -> None:
    async with _serving(0) as link:
        first_reader, first_writer = await asyncio.open_connection(*link.local)
        await _hears(first_reader, "HEARTBEAT")
        request = dialect.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
        first_writer.write(Packer(255, 190).pack(request))
        await _hears(first_reader, "AUTOPILOT_VERSION")
        second_reader, second_writer = await asyncio.open_connection(*link.local)
        await _hears(second_reader, "HEARTBEAT")
        async with asyncio.timeout(20.0):
            with contextlib.suppress(ConnectionError):
                while await first_reader.read(4096):
                    pass
        first_writer.close()
        second_writer.close()


async def test_a_port_in_use_is_named() -> None:
    async with _serving(0) as link:
        with pytest.raises(PortError, match=f"TCP port {link.local[1]} .* is in use"):
            async with _serving(link.local[1]):
                pass
