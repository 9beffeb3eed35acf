"""The shim over UDP: PX4's ports, latching, several links, a clock that may stall."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Sequence

import pytest

from sitl_shim.driver import LoopDriver
from sitl_shim.mavlink.endpoint import Datagram, Shim
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Packer, Parser, dialect
from sitl_shim.server import BoundLink, PortError, UdpLink, default_links, serve
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.server.shim_process import free_port
from tests.sitl_shim.server.virtual_loop import VirtualLoop, run_virtually

_FAST = ShimOptions(speed=10.0)


class _Peer(asyncio.DatagramProtocol):
    """A client's socket that keeps what it gets."""

    def __init__(self) -> None:
        self.names: list[str] = []
        self.senders: set[tuple[str, int]] = set()
        self.arrived = asyncio.Event()

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        self.senders.add(addr)
        self.names += [message.get_type() for message in Parser().parse(data)]
        self.arrived.set()

    async def hears_something(self) -> None:
        self.arrived.clear()
        await asyncio.wait_for(self.arrived.wait(), 10.0)


@contextlib.asynccontextmanager
async def _peer(port: int) -> AsyncIterator[tuple[asyncio.DatagramTransport, _Peer]]:
    loop = asyncio.get_running_loop()
    transport, peer = await loop.create_datagram_endpoint(_Peer, local_addr=("127.0.0.1", port))
    try:
        yield transport, peer
    finally:
        transport.close()


@contextlib.asynccontextmanager
async def _serving(links: Sequence[UdpLink]) -> AsyncIterator[Sequence[BoundLink]]:
    bound: asyncio.Future[Sequence[BoundLink]] = asyncio.get_running_loop().create_future()
    task = asyncio.ensure_future(serve(_FAST, links, ready=bound.set_result))
    done, _ = await asyncio.wait({task, bound}, return_when=asyncio.FIRST_COMPLETED)
    if task in done:
        task.result()
    try:
        yield bound.result()
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


def test_the_default_ports_are_those_of_px4() -> None:
    assert [(link.port, link.remote_port) for link in default_links(0)] == [
        (18570, 14550),
        (14580, 14540),
    ]
    assert [(link.port, link.remote_port) for link in default_links(3)] == [
        (18573, 14550),
        (14583, 14543),
    ]


async def test_it_speaks_first_and_to_the_default_port() -> None:
    port = free_port()
    async with _peer(port) as (_, peer), _serving([UdpLink(LinkKind.ONBOARD, 0, port)]) as bound:
        await peer.hears_something()
        assert peer.senders == {bound[0].local}
        assert bound[0].local[0] == "127.0.0.1"


async def test_a_link_latches_onto_its_first_peer_for_good() -> None:
    default, stranger = free_port(), free_port()
    link = UdpLink(LinkKind.ONBOARD, 0, default)
    async with (
        _peer(default) as (sender, peer),
        _peer(stranger) as (first, latched),
        _serving([link]) as bound,
    ):
        await peer.hears_something()
        packer = Packer(1, 191)
        first.sendto(packer.pack(dialect.MAVLink_ping_message(1, 1, 0, 0)), bound[0].local)
        await latched.hears_something()
        request = dialect.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
        # What was on its way to the old peer when the link latched arrives during the first round.
        for _ in range(2):
            peer.names.clear()
            latched.names.clear()
            sender.sendto(packer.pack(request), bound[0].local)
            while "AUTOPILOT_VERSION" not in latched.names:
                await latched.hears_something()
        assert peer.names == []


async def test_several_links_are_served_at_once() -> None:
    ports = [free_port() for _ in range(3)]
    kinds = [LinkKind.ONBOARD, LinkKind.GROUND_STATION, LinkKind.GROUND_STATION]
    links = [UdpLink(kind, 0, port) for kind, port in zip(kinds, ports, strict=True)]
    async with contextlib.AsyncExitStack() as stack:
        peers = [(await stack.enter_async_context(_peer(port)))[1] for port in ports]
        await stack.enter_async_context(_serving(links))
        for peer in peers:
            await peer.hears_something()


async def test_a_port_in_use_is_named_with_a_remedy() -> None:
    port = free_port()
    async with _peer(port):
        with pytest.raises(PortError, match=rf"{port}.*in use.*--instance"):
            await serve(_FAST, [UdpLink(LinkKind.ONBOARD, port, 14540)])


# --- the driver, on a virtual clock ---


class _StallingLoop(VirtualLoop):
    """Its clock can be pushed forward, as if the process had been suspended."""

    def stall(self, duration_s: float) -> None:
        self._clock.passed_s += duration_s


async def _boot_time_after_stall(stall_s: float) -> float:
    loop = asyncio.get_running_loop()
    assert isinstance(loop, _StallingLoop)
    shim = Shim(ShimOptions(), (LinkKind.ONBOARD,))
    driver = LoopDriver(shim, speed=1.0, deliver=lambda _, __: None)
    running = asyncio.ensure_future(driver.run())
    await asyncio.sleep(1.0)
    loop.stall(stall_s)
    await asyncio.sleep(1.0)
    running.cancel()
    return shim.time_s


@pytest.mark.parametrize(("stall_s", "boot_s"), [(0.0, 2.0), (0.5, 2.5), (60.0, 3.0)])
def test_a_short_stall_is_caught_up_and_a_long_one_stops_the_boot_clock(
    stall_s: float, boot_s: float
) -> None:
    with asyncio.Runner(loop_factory=lambda: _StallingLoop(0.0)) as runner:
        assert runner.run(_boot_time_after_stall(stall_s)) == pytest.approx(boot_s, abs=0.15)


class _SlowShim(Shim):
    """Each of its ticks costs time of the loop's clock."""

    cost_s = 0.0

    def step(self) -> list[Datagram]:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, _StallingLoop)
        loop.stall(self.cost_s)
        return super().step()


async def _ping_latencies(*, stall_s: float, cost_s: float, speed: float) -> list[float]:
    """Loop seconds from each PING, sent every 50 ms after a stall, to its answer."""
    loop = asyncio.get_running_loop()
    assert isinstance(loop, _StallingLoop)
    answered_s: dict[int, float] = {}
    parser = Parser()

    def deliver(_: int, data: bytes) -> None:
        for message in parser.parse(data):
            if message.get_type() == "PING" and message.target_system:
                answered_s[message.seq] = loop.time()

    shim = _SlowShim(ShimOptions(), (LinkKind.ONBOARD,))
    driver = LoopDriver(shim, speed=speed, deliver=deliver)
    packer = Packer(1, 191)
    running = asyncio.ensure_future(driver.run())
    await asyncio.sleep(1.0)
    shim.cost_s = cost_s
    loop.stall(stall_s)
    sent_s: list[float] = []
    for seq in range(60):
        driver.receive(0, packer.pack(dialect.MAVLink_ping_message(seq, seq, 0, 0)))
        sent_s.append(loop.time())
        await asyncio.sleep(0.05)
    await asyncio.sleep(2.0)
    running.cancel()
    assert len(answered_s) == len(sent_s)
    assert list(answered_s) == sorted(answered_s)
    return [answered_s[seq] - sent for seq, sent in enumerate(sent_s)]


@pytest.mark.parametrize(
    ("stall_s", "cost_s", "speed"),
    [
        (0.0, 0.001, 1.0),
        (0.5, 0.003, 1.0),
        (60.0, 0.003, 1.0),
        (0.0, 0.005, 1.0),
        (0.0, 0.002, 10.0),
    ],
    ids=["in time", "short stall", "long stall", "slow machine", "too much speed"],
)
def test_what_comes_in_while_it_is_behind_is_answered_at_once(
    stall_s: float, cost_s: float, speed: float
) -> None:
    with asyncio.Runner(loop_factory=lambda: _StallingLoop(0.0)) as runner:
        latencies_s = runner.run(_ping_latencies(stall_s=stall_s, cost_s=cost_s, speed=speed))
    # Two batches of 25 ticks at most pass between two looks at timers, and 30 ms on the way.
    assert max(latencies_s) < 50 * cost_s + 0.04


async def _run_failing_shim() -> None:
    shim = Shim(ShimOptions(), (LinkKind.ONBOARD,))

    def deliver(_: int, __: bytes) -> None:
        raise RuntimeError("the client is broken")

    # bebop2's telemetry is delayed: the failure happens in a timer of its own
    driver = LoopDriver(shim, speed=1.0, deliver=deliver)
    await asyncio.wait_for(driver.run(), 3.0)


def test_a_failure_in_a_timer_ends_the_run() -> None:
    with pytest.raises(RuntimeError, match="the client is broken"):
        run_virtually(_run_failing_shim())
