import asyncio
import socket

import pytest

from companion.link.link import LinkError
from companion.link.udp import UdpLink
from companion.link.url import parse_link_url
from companion.mavlink.codec import Packer, encode
from companion.mavlink.messages import VehicleStateOfHealth, heartbeat
from companion.mavlink.peers import vehicle_heartbeat_in

PACKET = Packer(1, 1).pack(
    encode(
        "HEARTBEAT",
        type=2, autopilot=12, base_mode=0, custom_mode=0, system_status=3, mavlink_version=3,
    )
)  # fmt: skip
OF_GROUND_STATION = Packer(255, 190).pack(heartbeat(VehicleStateOfHealth.ACTIVE))
LOOPBACK = "127.0.0.1"


async def open_link(url, on_bytes):
    link = UdpLink(parse_link_url(url), vehicle_heartbeat_in)
    link.on_bytes = on_bytes
    await link.open()
    return link


class Inbox:
    """Takes what a link receives, and lets a test wait for it."""

    def __init__(self):
        self.received = []
        self._arrived = asyncio.Event()

    def __call__(self, data, received_at_s):
        self.received.append((data, received_at_s))
        self._arrived.set()

    @property
    def datagrams(self):
        return [data for data, _ in self.received]

    async def wait_for(self, count):
        while len(self.received) < count:
            self._arrived.clear()
            await asyncio.wait_for(self._arrived.wait(), 10)


class Remote:
    """A plain socket on the other side."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((LOOPBACK, 0))
        self.socket.setblocking(False)
        self.port = self.socket.getsockname()[1]

    def send(self, data, port):
        self.socket.sendto(data, (LOOPBACK, port))

    async def receive(self):
        loop = asyncio.get_running_loop()
        return await asyncio.wait_for(loop.sock_recv(self.socket, 2048), 10)


@pytest.fixture
def remotes():
    made = [Remote(), Remote()]
    yield made
    for remote in made:
        remote.socket.close()


async def test_the_first_valid_sender_becomes_the_peer_and_gets_the_answers(remotes):
    vehicle, _ = remotes
    inbox = Inbox()
    link = await open_link(f"udpin://{LOOPBACK}:0", inbox)
    try:
        assert link.peer is None
        before_s = asyncio.get_running_loop().time()
        vehicle.send(PACKET, link.local[1])
        await inbox.wait_for(1)
        link.send(b"answer")

        assert await vehicle.receive() == b"answer"
        assert link.peer == (LOOPBACK, vehicle.port)
        assert inbox.received[0][0] == PACKET
        assert before_s <= inbox.received[0][1] <= asyncio.get_running_loop().time()
        assert (link.counters.packets_in, link.counters.bytes_in) == (1, len(PACKET))
        assert (link.counters.packets_out, link.counters.bytes_out) == (1, 6)
        assert link.description == f"udpin://{LOOPBACK}:{link.local[1]}"
    finally:
        link.close()


async def test_once_locked_a_foreign_sender_is_dropped_and_counted(remotes):
    vehicle, stranger = remotes
    inbox = Inbox()
    link = await open_link(f"udpin://{LOOPBACK}:0", inbox)
    try:
        vehicle.send(PACKET, link.local[1])
        await inbox.wait_for(1)
        stranger.send(PACKET, link.local[1])
        stranger.send(PACKET, link.local[1])
        vehicle.send(PACKET + PACKET, link.local[1])
        await inbox.wait_for(2)
        link.send(b"to the vehicle")

        assert inbox.datagrams == [PACKET, PACKET + PACKET]
        assert link.counters.foreign_packets == 2
        assert link.peer == (LOOPBACK, vehicle.port)
        assert await vehicle.receive() == b"to the vehicle"
    finally:
        link.close()


@pytest.mark.parametrize(
    "said",
    [
        b"hello",
        b"\xfd" + bytes(11),
        b"\xfe\x00" + bytes(6),
        PACKET[:-1] + bytes([PACKET[-1] ^ 1]),
        OF_GROUND_STATION,
    ],
    ids=["text", "v2 by its looks", "v1 by its looks", "wrong CRC", "ground station"],
)
async def test_who_is_no_vehicle_does_not_lock_the_vehicle_out(remotes, said):
    vehicle, stranger = remotes
    inbox = Inbox()
    link = await open_link(f"udpin://{LOOPBACK}:0", inbox)
    try:
        stranger.send(said, link.local[1])
        vehicle.send(PACKET, link.local[1])
        await inbox.wait_for(1)

        assert inbox.datagrams == [PACKET]
        assert link.peer == (LOOPBACK, vehicle.port)
        assert link.counters.foreign_packets == 1
    finally:
        link.close()


async def test_much_may_wait_in_the_system():
    link = await open_link(f"udpin://{LOOPBACK}:0", lambda data, time_s: None)
    try:
        granted = link._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    finally:
        link.close()

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as reference:
        reference.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        assert granted == reference.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)


async def test_udpout_speaks_first_and_hears_only_its_peer(remotes):
    vehicle, stranger = remotes
    inbox = Inbox()
    link = await open_link(f"udpout://{LOOPBACK}:{vehicle.port}", inbox)
    try:
        link.send(PACKET)
        assert await vehicle.receive() == PACKET
        stranger.send(b"no", link.local[1])
        vehicle.send(b"yes", link.local[1])
        await inbox.wait_for(1)

        assert inbox.datagrams == [b"yes"]
    finally:
        link.close()


async def test_a_peer_that_is_not_there_yet_does_not_end_the_link(remotes):
    vehicle, _ = remotes
    port = vehicle.port
    vehicle.socket.close()
    inbox = Inbox()
    link = await open_link(f"udpout://{LOOPBACK}:{port}", inbox)
    try:
        for _ in range(1000):
            link.send(PACKET)
            await asyncio.sleep(0)
            if link.counters.errors:
                break
        assert link.counters.errors > 0, "the system has reported that nobody listens"

        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as late:
            late.bind((LOOPBACK, port))
            late.sendto(b"here I am", (LOOPBACK, link.local[1]))
            await inbox.wait_for(1)
        assert inbox.datagrams == [b"here I am"]
    finally:
        link.close()


async def test_a_vehicle_that_restarts_at_another_port_is_found_again_once_it_was_silent(
    remotes, monkeypatch
):
    before, after = remotes
    inbox = Inbox()
    link = await open_link(f"udpin://{LOOPBACK}:0", inbox)
    changes = []
    link.on_change = changes.append
    try:
        before.send(PACKET, link.local[1])
        await inbox.wait_for(1)
        monkeypatch.setattr("companion.link.udp.SILENT_AFTER_S", 0.0)
        after.send(OF_GROUND_STATION, link.local[1])
        after.send(PACKET, link.local[1])
        await inbox.wait_for(2)
        link.send(b"found")

        assert await after.receive() == b"found"
        assert changes == [""]
        assert link.counters.connections == 2
        assert link.counters.foreign_packets == 1
    finally:
        link.close()


async def test_a_host_that_never_was_the_peer_does_not_become_it(monkeypatch):
    link = await open_link(f"udpin://{LOOPBACK}:0", lambda data, time_s: None)
    monkeypatch.setattr("companion.link.udp.SILENT_AFTER_S", 0.0)
    try:
        link.take(PACKET, ("192.0.2.1", 14580), 1.0)
        link.take(PACKET, ("192.0.2.2", 14580), 100.0)

        assert link.peer == ("192.0.2.1", 14580)
        assert link.counters.foreign_packets == 1
    finally:
        link.close()


async def test_without_a_peer_nothing_is_sent_and_nothing_raises():
    link = await open_link(f"udpin://{LOOPBACK}:0", lambda data, time_s: None)
    link.send(PACKET)
    link.close()
    link.send(PACKET)
    link.close()

    assert link.counters.unsent_packets == 2
    assert link.counters.packets_out == 0


async def test_a_port_in_use_is_explained(remotes):
    taken = remotes[0].port

    with pytest.raises(LinkError) as caught:
        await open_link(f"udpin://{LOOPBACK}:{taken}", lambda data, time_s: None)

    message = str(caught.value)
    assert f"udpin://{LOOPBACK}:{taken}" in message
    assert "in use" in message
    assert "another port" in message


async def test_an_address_of_another_computer_cannot_be_bound_to():
    with pytest.raises(LinkError, match=r"0\.0\.0\.0 for all"):
        await open_link("udpin://192.0.2.1:14540", lambda data, time_s: None)


async def test_an_unknown_host_is_explained():
    with pytest.raises(LinkError, match=r"no-such-host\.invalid.*spelling"):
        await open_link("udpout://no-such-host.invalid:14580", lambda data, time_s: None)
