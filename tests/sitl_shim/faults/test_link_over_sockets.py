"""Faults of the link around a shim that answers over real sockets."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from typing import Any

import pytest
from typer.testing import CliRunner

from sitl_shim.cli import app
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Packer, Parser, dialect
from sitl_shim.server import BoundLink, TcpServer, UdpLink, serve
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.server.shim_process import free_port, running_shim

_TRUTH = 240
# Each PING comes twice, and after the first second of the boot the vehicle is silent for one.
_FAULTS = (
    "{link: [{way: telemetry, from_s: 1.0, until_s: 2.0, pause: true},"
    " {way: setpoints, duplicate: 1.0}]}"
)
_OPTIONS = ShimOptions(faults=_FAULTS, speed=5.0)


class _Ear:
    """Keeps what has been heard."""

    def __init__(self) -> None:
        self._parser = Parser()
        self._news = asyncio.Event()
        self.messages: list[Any] = []

    def hear(self, data: bytes) -> None:
        self.messages += self._parser.parse(data)
        self._news.set()

    def stamps_s(self, name: str, *, truth: bool) -> list[float]:
        """Autopilot times of the messages of a name."""
        return [
            message.time_boot_ms / 1e3
            if hasattr(message, "time_boot_ms")
            else message.time_usec / 1e6
            for message in self.messages
            if message.get_type() == name and (message.get_srcComponent() == _TRUTH) == truth
        ]

    def answers(self) -> int:
        return sum(m.get_type() == "PING" and m.target_system != 0 for m in self.messages)

    async def until(self, done: Any) -> None:
        async with asyncio.timeout(30.0):
            while not done():
                self._news.clear()
                await self._news.wait()


class _Datagrams(asyncio.DatagramProtocol):
    def __init__(self, ear: _Ear) -> None:
        self._ear = ear

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        self._ear.hear(data)


@contextlib.asynccontextmanager
async def _serving(link: UdpLink | TcpServer) -> AsyncIterator[BoundLink]:
    bound: asyncio.Future[BoundLink] = asyncio.get_running_loop().create_future()
    task = asyncio.ensure_future(
        serve(_OPTIONS, [link], ready=lambda links: bound.set_result(links[0]))
    )
    await asyncio.wait({task, bound}, return_when=asyncio.FIRST_COMPLETED)
    if task.done():
        task.result()
    try:
        yield bound.result()
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


def _check_the_pause(ear: _Ear) -> None:
    heard = ear.stamps_s("ATTITUDE", truth=False)
    truth = ear.stamps_s("ODOMETRY", truth=True)
    # Stamps are of the moment at which a message left, 15 ms before it arrived.
    assert [stamp_s for stamp_s in heard if 1.0 < stamp_s < 1.98] == []
    assert len([stamp_s for stamp_s in heard if stamp_s < 1.0]) > 10
    assert len([stamp_s for stamp_s in truth if 1.0 < stamp_s < 1.98]) > 10


def _ping() -> bytes:
    return Packer(1, 191).pack(dialect.MAVLink_ping_message(0, 7, 0, 0))


async def test_over_udp() -> None:
    ear = _Ear()
    port = free_port()
    transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(
        lambda: _Datagrams(ear), local_addr=("127.0.0.1", port)
    )
    async with _serving(UdpLink(LinkKind.ONBOARD, 0, port)) as link:
        await ear.until(lambda: max(ear.stamps_s("ATTITUDE", truth=False), default=0.0) > 2.0)
        transport.sendto(_ping(), link.local)
        await ear.until(lambda: ear.answers() == 2)
    transport.close()
    _check_the_pause(ear)


async def test_over_tcp() -> None:
    ear = _Ear()
    async with _serving(TcpServer(LinkKind.ONBOARD, 0)) as link:
        reader, writer = await asyncio.open_connection(*link.local)

        async def listen() -> None:
            while data := await reader.read(65536):
                ear.hear(data)

        listening = asyncio.ensure_future(listen())
        await ear.until(lambda: max(ear.stamps_s("ATTITUDE", truth=False), default=0.0) > 2.0)
        writer.write(_ping())
        await ear.until(lambda: ear.answers() == 2)
        listening.cancel()
        writer.close()
    _check_the_pause(ear)


# --- the command line ---


async def test_run_takes_faults_as_a_name_and_says_so() -> None:
    async with running_shim("--onboard-port=0", "--gcs-port=0", "--faults=bad-link") as (_, line):
        assert line.startswith("ready: px4 bebop2 in calm with bad-link, seed 0")


@pytest.mark.parametrize(
    ("faults", "words"),
    [
        ("worse-link", ["worse-link", "bad-link", "slow-link"]),
        ("{link: [{los: 0.1}]}", ["link.0.los", "did you mean 'loss'"]),
        ("{link: [{loss: 30}]}", ["link.0.loss", "less than or equal to 1"]),
        ("{link: [{from_s: 5, until_s: 2}]}", ["until_s must be later than from_s"]),
        ("no/such/file.yaml", ["no/such/file.yaml", "cannot be read"]),
    ],
)
def test_faults_that_are_none_are_refused_with_the_place(faults: str, words: list[str]) -> None:
    arguments = ["run", "--onboard-port=0", "--gcs-port=0", f"--faults={faults}"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert all(word in result.stderr for word in words), result.stderr
    assert "Traceback" not in result.stderr
