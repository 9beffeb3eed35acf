import pytest

from companion.flight.vehicle.connection import Connection
from companion.link.memory import MemoryLink
from companion.mavlink.codec import Packer, encode


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
