import asyncio
import contextlib
import socket

import pytest

from companion.link import tcp
from companion.link.link import LinkError
from companion.link.make import make_link
from companion.link.url import parse_link_url
from companion.mavlink.peers import vehicle_heartbeat_in
from tests.companion.link.sockets import (
    LOOPBACK,
    OF_GROUND_STATION,
    PACKET,
    Heard,
    TcpPeer,
    until,
)


@contextlib.asynccontextmanager
async def opened(url):
    link = make_link(parse_link_url(url), vehicle_heartbeat_in)
    heard = Heard(link)
    try:
        await link.open()
        yield link, heard
    finally:
        link.close()


@contextlib.asynccontextmanager
async def vehicle(port=0, **options):
    peer = TcpPeer(**options)
    port = await peer.listen(port)
    try:
        yield peer, port
    finally:
        peer.close()


async def call(port):
    return await asyncio.open_connection(LOOPBACK, port)


def free_port():
    with socket.socket() as taken:
        taken.bind((LOOPBACK, 0))
        return taken.getsockname()[1]


async def test_tcpout_carries_bytes_both_ways():
    async with vehicle() as (peer, port), opened(f"tcpout://{LOOPBACK}:{port}") as (link, heard):
        await until(lambda: not link.down_because and peer.calls)
        link.send(b"out")
        peer.calls[0].write(b"in")
        await until(lambda: peer.data == b"out" and heard.data == b"in")

        assert heard.changes == [""]
        assert (link.counters.bytes_out, link.counters.bytes_in) == (3, 2)
        assert link.datagrams is False


async def test_a_vehicle_that_is_not_there_yet_is_waited_for_and_the_link_says_why():
    port = free_port()
    async with opened(f"tcpout://{LOOPBACK}:{port}") as (link, heard):
        await until(lambda: link.counters.errors >= 2)
        assert "refused" in link.down_because
        link.send(b"nobody")
        assert link.counters.unsent_packets == 1

        async with vehicle(port) as (peer, _):
            await until(lambda: peer.calls and not link.down_because)

        assert "refused" in heard.changes[0]
        assert heard.changes[1:] == [""], "the same refusal is told once"


async def test_tcpout_connects_again_after_it_was_cut():
    async with vehicle() as (peer, port), opened(f"tcpout://{LOOPBACK}:{port}") as (link, heard):
        await until(lambda: peer.calls)
        peer.hang_up()
        await until(lambda: len(peer.calls) == 2 and not link.down_because)
        link.send(b"again")
        await until(lambda: peer.data == b"again")

        assert [bool(change) for change in heard.changes] == [False, True, False]
        assert link.counters.connections == 2


async def test_a_half_open_connection_is_made_anew(monkeypatch):
    monkeypatch.setattr(tcp, "SILENT_AFTER_S", 0.3)
    async with vehicle() as (peer, port), opened(f"tcpout://{LOOPBACK}:{port}") as (_, heard):
        await until(lambda: len(peer.calls) == 2)  # says nothing, and did not hang up

        assert "nothing came" in heard.changes[1]


async def test_what_the_other_side_does_not_take_is_dropped_and_never_queues(monkeypatch):
    monkeypatch.setattr(tcp, "BLOCKED_AFTER_S", 1e9)
    async with (
        vehicle(reads=False) as (peer, port),
        opened(f"tcpout://{LOOPBACK}:{port}") as (link, _),
    ):
        await until(lambda: peer.calls and not link.down_because)
        for _ in range(100):  # far more than what sockets take
            for _ in range(400):
                link.send(bytes(280))
            await asyncio.sleep(0)

        assert link.counters.unsent_packets > 30_000
        assert link._stream._waiting() <= tcp._LIMIT_BYTES


async def test_a_connection_that_takes_nothing_is_cut_so_that_nothing_stale_arrives(monkeypatch):
    monkeypatch.setattr(tcp, "BLOCKED_AFTER_S", 0.2)
    async with (
        vehicle(reads=False) as (peer, port),
        opened(f"tcpout://{LOOPBACK}:{port}") as (link, heard),
    ):
        await until(lambda: peer.calls and not link.down_because)

        def cut():
            for _ in range(400):
                link.send(bytes(280))
            return any("took nothing" in change for change in heard.changes)

        await until(cut)


async def test_tcpin_takes_the_first_vehicle_and_turns_others_away():
    async with opened(f"tcpin://{LOOPBACK}:0") as (link, heard):
        port = link.local[1]
        assert link.description == f"tcpin://{LOOPBACK}:{port}"
        stranger_reads, stranger = await call(port)
        stranger.write(b"hello" + OF_GROUND_STATION)
        vehicle_reads, vehicle = await call(port)
        vehicle.write(b"noise" + PACKET[:9])
        await vehicle.drain()
        await until(lambda: any(PACKET[:9] in said for said in link._strangers.values()))
        assert link.down_because
        vehicle.write(PACKET[9:])
        await until(lambda: not link.down_because)
        link.send(b"to the vehicle")

        assert await asyncio.wait_for(vehicle_reads.readexactly(14), 5) == b"to the vehicle"
        assert heard.data == b"noise" + PACKET
        with contextlib.suppress(ConnectionError):
            assert await asyncio.wait_for(stranger_reads.read(), 5) == b""
        late_reads, late = await call(port)
        with contextlib.suppress(ConnectionError):
            assert await asyncio.wait_for(late_reads.read(), 5) == b""
        assert link.counters.foreign_packets == 2
        for writer in (stranger, vehicle, late):
            writer.close()


async def test_tcpin_takes_the_vehicle_again_when_it_calls_again():
    async with opened(f"tcpin://{LOOPBACK}:0") as (link, heard):
        for count in (1, 2):
            _, vehicle = await call(link.local[1])
            vehicle.write(PACKET)
            await until(lambda count=count: link.counters.connections == count)
            vehicle.transport.abort()
            await until(lambda: link.down_because)

        assert [bool(change) for change in heard.changes] == [False, True, False, True]


async def test_a_silent_peer_makes_room_for_the_vehicle(monkeypatch):
    monkeypatch.setattr(tcp, "SILENT_AFTER_S", 0.3)
    async with opened(f"tcpin://{LOOPBACK}:0") as (link, _):
        _, half_open = await call(link.local[1])
        half_open.write(PACKET)
        await until(lambda: link.counters.connections == 1)
        await until(lambda: link.down_because)
        _, vehicle = await call(link.local[1])
        vehicle.write(PACKET)
        await until(lambda: link.counters.connections == 2)
        for writer in (half_open, vehicle):
            writer.close()


async def test_who_never_says_that_it_is_a_vehicle_is_not_kept(monkeypatch):
    monkeypatch.setattr(tcp, "SILENT_AFTER_S", 0.2)
    async with opened(f"tcpin://{LOOPBACK}:0") as (link, _):
        calls = [await call(link.local[1]) for _ in range(6)]
        await until(lambda: link.counters.foreign_packets == 6)
        assert not link._strangers
        reads, talker = await call(link.local[1])
        with contextlib.suppress(ConnectionError):
            talker.write(bytes(100_000))
            await asyncio.wait_for(reads.read(), 5)
        for _, writer in [*calls, (reads, talker)]:
            writer.close()


@pytest.mark.parametrize("scheme", ["tcpin", "tcpout"])
async def test_an_unknown_host_is_explained(scheme):
    with pytest.raises(LinkError, match=r"no-such-host\.invalid.*spelling"):
        async with opened(f"{scheme}://no-such-host.invalid:5760"):
            pass


async def test_a_port_in_use_is_explained():
    async with vehicle() as (_, port):
        with pytest.raises(LinkError, match=f"TCP port {port}"):
            async with opened(f"tcpin://{LOOPBACK}:{port}"):
                pass


async def test_a_closed_link_sends_nothing_and_connects_no_more():
    async with vehicle() as (peer, port):
        async with opened(f"tcpout://{LOOPBACK}:{port}") as (link, _):
            await until(lambda: peer.calls)
        link.send(b"late")
        link.close()

        assert link.counters.unsent_packets == 1
        assert len(peer.calls) == 1


async def test_a_stranger_who_says_much_in_small_words_is_not_heard_for_ever():
    looked_at = []

    def accept(data):
        looked_at.append(len(data))
        return vehicle_heartbeat_in(data)

    link = tcp.TcpInLink(parse_link_url(f"tcpin://{LOOPBACK}:0"), accept)
    await link.open()
    try:
        reader, writer = await asyncio.open_connection(LOOPBACK, link.local[1])
        link_ended = asyncio.ensure_future(reader.read())
        while not link_ended.done() and len(looked_at) < 1000:
            writer.write(b"\xfe")
            await asyncio.sleep(0.001)
        assert link.counters.foreign_packets == 1
        assert len(looked_at) <= 64
        assert max(looked_at) <= 8192
        link_ended.cancel()
        writer.close()
        _, slow = await asyncio.open_connection(LOOPBACK, link.local[1])
        for byte in PACKET:
            slow.write(bytes([byte]))
            await asyncio.sleep(0)
        await until(lambda: link.counters.connections == 1)
        slow.close()
    finally:
        link.close()
