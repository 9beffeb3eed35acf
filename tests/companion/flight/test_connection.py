import asyncio
import socket

import pytest

from companion.flight.clock import run_in_virtual_time
from companion.flight.vehicle.connection import Connection
from companion.link.make import make_link
from companion.link.memory import MemoryLink
from companion.link.udp import UdpLink
from companion.link.url import parse_link_url
from companion.mavlink.codec import Packer, encode
from companion.mavlink.framing import Framer
from companion.mavlink.messages import MessageId


class NoLog:
    def frame_in(self, time_s, raw):
        pass

    def frame_out(self, time_s, raw):
        pass


def vehicle_heartbeat(packer):
    return packer.pack(
        encode(
            "HEARTBEAT",
            type=2, autopilot=12, base_mode=0, custom_mode=0, system_status=3, mavlink_version=3,
        )
    )  # fmt: skip


@pytest.mark.parametrize("tail", [b"\xfd\xff\x00", b"\xfe\xff", b"\xfd"])
async def test_a_junk_tail_of_a_datagram_delays_no_packet_of_the_next_ones(tail):
    link = MemoryLink(lambda data: None)
    connection = Connection(link, NoLog())
    await link.open()
    packer = Packer(1, 1)
    heard = []

    for _ in range(5):
        link.receive(vehicle_heartbeat(packer) + tail)
        heard.append(connection.peers.peers[(1, 1)].received)

    assert heard == [1, 2, 3, 4, 5]


async def test_a_packet_behind_a_false_start_comes_with_its_own_datagram():
    link = MemoryLink(lambda data: None)
    connection = Connection(link, NoLog())
    await link.open()

    link.receive(b"\xfd\xff\x00" + vehicle_heartbeat(Packer(1, 1)))

    assert connection.peers.vehicle is not None


async def test_over_udpout_a_vehicle_that_waits_to_be_spoken_to_is_found():
    loop = asyncio.get_running_loop()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        vehicle.setblocking(False)
        url = parse_link_url(f"udpout://127.0.0.1:{vehicle.getsockname()[1]}")
        link = UdpLink(url, lambda _: True)
        connection = Connection(link, NoLog(), system_id=7)
        await link.open()
        task = loop.create_task(connection.housekeeping(lambda text: None))
        try:
            data, address = await asyncio.wait_for(loop.sock_recvfrom(vehicle, 512), 30.0)
            (frame,) = Framer().feed(data)
            assert (frame.message_id, frame.system_id) == (MessageId.HEARTBEAT, 7)
            vehicle.sendto(vehicle_heartbeat(Packer(7, 1)), address)
            await connection.waiting.until(lambda: connection.peers.vehicle is not None, 30.0, str)
        finally:
            task.cancel()
            link.close()


@pytest.mark.parametrize("address", ["udpin://127.0.0.1:0", "tcpout://127.0.0.1:1"])
def test_where_the_vehicle_speaks_by_itself_nothing_is_sent_before(address):
    sent = []
    link = MemoryLink(sent.append)
    link.speaks_first = make_link(parse_link_url(address), lambda _: True).speaks_first

    async def listen():
        connection = Connection(link, NoLog())
        await link.open()
        task = asyncio.get_running_loop().create_task(connection.housekeeping(lambda text: None))
        await asyncio.sleep(5.0)
        task.cancel()

    run_in_virtual_time(listen())
    assert sent == []
