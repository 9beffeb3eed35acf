"""What a connection makes of a link that comes and goes, and of others on it."""

from companion.flight.vehicle.connection import Connection
from companion.link.memory import MemoryLink
from companion.mavlink.codec import Packer, encode
from companion.mavlink.messages import VehicleStateOfHealth, heartbeat


class NoLog:
    def frame_in(self, time_s, raw):
        pass

    def frame_out(self, time_s, raw):
        pass


def vehicle_heartbeat(system=1):
    return Packer(system, 1).pack(
        encode(
            "HEARTBEAT",
            type=2, autopilot=12, base_mode=0, custom_mode=0, system_status=3, mavlink_version=3,
        )
    )  # fmt: skip


async def connected():
    link = MemoryLink(lambda data: None, "tcpout://vehicle:1")
    link.datagrams = False
    connection = Connection(link, NoLog())
    await link.open()
    return link, connection


async def test_a_frame_that_was_cut_with_the_link_swallows_none_behind_it():
    link, connection = await connected()
    changes = []
    connection.on_link_change = changes.append
    link.receive(vehicle_heartbeat()[:-3])
    link.on_change("the other side ended the connection")
    link.on_change("")
    assert connection.framer.pending_bytes == 0

    link.receive(vehicle_heartbeat())

    assert connection.peers.vehicle is not None
    assert changes == ["the other side ended the connection", ""]


async def test_the_link_says_where_it_leads_and_what_is_wrong_with_it():
    link, connection = await connected()
    assert connection.link_description == "tcpout://vehicle:1"

    link.down_because = "Connection refused"

    assert connection.link_description == "tcpout://vehicle:1 (Connection refused)"


async def test_each_other_vehicle_is_told_of_once_and_ground_stations_never():
    link, connection = await connected()
    others = []
    connection.on_other_vehicle = others.append

    for _ in range(3):
        link.receive(vehicle_heartbeat(1) + vehicle_heartbeat(2) + vehicle_heartbeat(3))
        link.receive(Packer(255, 190).pack(heartbeat(VehicleStateOfHealth.ACTIVE)))

    assert [other.system_id for other in others] == [2, 3]


async def test_forwarding_that_fails_is_told_and_ends_nothing():
    link, connection = await connected()
    troubles = []
    connection.on_trouble = troubles.append

    def fail(frames):
        raise RuntimeError("broken")

    connection.on_frames = fail
    link.receive(vehicle_heartbeat())
    link.receive(vehicle_heartbeat())

    assert len(troubles) == 1
    assert "forwarding could not be dealt with" in troubles[0]
