"""Others on the link of a flight: more vehicles, ground stations, what they send by the wire."""

import struct

from companion.mavlink.codec import Packer, encode
from companion.mavlink.dialects.px4 import Px4
from companion.mavlink.messages import MessageId, Outgoing
from tests.flights.bench import Bench

_PX4_ARMED = {"autopilot": 12, "base_mode": 0x91, "system_status": 4, "mavlink_version": 3}


def heartbeat_of(packer, kind=2, mode="land", **fields):
    values = {"type": kind, "custom_mode": Px4().custom_mode(mode)} | _PX4_ARMED | fields
    return packer.pack(encode("HEARTBEAT", **values))


class SecondVehicle:
    """Repeats all that the first one says as system 2, but from another place and in disorder."""

    def __init__(self):
        self.packer = Packer(2, 1)
        self.ground_station = Packer(255, 190)

    def __call__(self, packet):
        payload = packet.payload
        if packet.component_id != 1:
            return packet.raw
        more = b""
        if packet.message_id == MessageId.HEARTBEAT:
            more = heartbeat_of(self.packer) + heartbeat_of(self.ground_station, 6)
        elif packet.message_id == MessageId.ODOMETRY:
            elsewhere = struct.pack("<3f", 50.0, -70.0, -9.0)
            more = self.packer.pack(
                Outgoing(packet.message_id, payload[:8] + elsewhere + payload[20:])
            )
        elif packet.message_id in (MessageId.CURRENT_MODE, MessageId.EXTENDED_SYS_STATE):
            more = self.packer.pack(Outgoing(packet.message_id, bytes(len(payload))))
        elif packet.message_id == MessageId.COMMAND_ACK:
            more = self.packer.pack(Outgoing(packet.message_id, payload[:2] + b"\x04"))
        return packet.raw + more


def as_bytes(setpoints):
    return [(s.time_s, s.quaternion, s.thrust) for s in setpoints]


def test_a_second_vehicle_on_the_link_changes_no_setpoint_and_is_told(tmp_path):
    alone, crowded = (tmp_path / name for name in ("alone", "crowded"))
    alone.mkdir()
    crowded.mkdir()
    without = Bench(alone).fly()
    bench = Bench(crowded)
    bench.wire.from_shim = SecondVehicle()
    flown = bench.fly()

    assert flown.outcome.outcome == "landed", flown.outcome.note
    assert as_bytes(flown.wire.setpoints) == as_bytes(without.wire.setpoints)
    (told,) = flown.told("system 2 component 1 is on the link, too")
    assert told < flown.began("arm")
    assert not any("system 255" in text for _, _, text in flown.seen.messages)


def test_the_system_to_fly_can_be_chosen_and_is_waited_for(bench):
    flown = bench.fly(settings={"link.system_id": "7", "timeouts.connect_s": "2.0"})

    assert flown.outcome.outcome == "refused"
    assert any("system 1 component 1" in text for _, _, text in flown.seen.messages)
    assert not flown.was_armed


def test_the_chosen_system_is_flown_though_another_was_heard_first(bench):
    bench.wire.send_to_companion(Outgoing(MessageId.SYS_STATUS, b"\0"))
    bench.wire._from_shim_too.append(heartbeat_of(Packer(2, 1)))

    flown = bench.fly(settings={"link.system_id": "1"})

    assert flown.outcome.outcome == "landed", flown.outcome.note
