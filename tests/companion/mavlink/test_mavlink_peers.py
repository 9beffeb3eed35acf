import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.mavlink.codec import Packer, decode, encode
from companion.mavlink.framing import Framer
from companion.mavlink.peers import PeerTable, vehicle_heartbeat_in


def heartbeat_bytes(system=1, component=1, kind=2, autopilot=12, packer=None):
    packer = packer or Packer(system, component)
    return packer.pack(
        encode(
            "HEARTBEAT",
            type=kind, autopilot=autopilot, base_mode=0, custom_mode=0, system_status=3,
            mavlink_version=3,
        )
    )  # fmt: skip


def hear(table, *args, **kwargs):
    (frame,) = Framer().feed(heartbeat_bytes(*args, **kwargs))
    table.on_heartbeat(frame, decode(frame))
    return frame


GROUND_STATION = {"system": 255, "component": 190, "kind": 6, "autopilot": 8}
COMPANION = {"system": 1, "component": 191, "kind": 18, "autopilot": 8}
BOASTING_GROUND_STATION = {"system": 255, "component": 190, "kind": 6, "autopilot": 12}
GIMBAL = {"system": 1, "component": 154, "kind": 26, "autopilot": 8}
QUIET_AUTOPILOT = {"system": 1, "component": 1, "kind": 2, "autopilot": 8}


@pytest.mark.parametrize(
    "other", [GROUND_STATION, COMPANION, BOASTING_GROUND_STATION, GIMBAL, QUIET_AUTOPILOT]
)
def test_what_is_no_vehicle_is_never_taken_for_one(other):
    table = PeerTable()

    hear(table, **other)

    assert table.vehicle is None
    assert table.other_vehicles == {}
    assert not vehicle_heartbeat_in(heartbeat_bytes(**other))


@pytest.mark.parametrize(("kind", "autopilot"), [(2, 12), (2, 3), (13, 12), (14, 3), (0, 12)])
def test_a_vehicle_is_found_by_its_heartbeat(kind, autopilot):
    table = PeerTable()
    hear(table, **GROUND_STATION)

    frame = hear(table, system=7, kind=kind, autopilot=autopilot)

    assert (table.vehicle.system_id, table.vehicle.component_id) == (7, 1)
    assert (table.vehicle.kind, table.vehicle.autopilot) == (kind, autopilot)
    assert table.vehicle.target == (7, 1)
    assert table.is_vehicle(frame)
    assert vehicle_heartbeat_in(b"noise" + frame.raw)


def test_a_second_vehicle_does_not_take_over():
    table = PeerTable()
    hear(table, system=3)

    second = hear(table, system=1)

    assert table.vehicle.system_id == 3
    assert list(table.other_vehicles) == [(1, 1)]
    assert not table.is_vehicle(second)


def test_the_autopilots_component_is_preferred_within_a_system():
    table = PeerTable()
    hear(table, system=1, component=5)
    hear(table, system=1, component=1)
    hear(table, system=1, component=6)

    assert table.vehicle.component_id == 1


def test_a_wanted_system_is_waited_for():
    table = PeerTable(wanted_system_id=4)
    hear(table, system=1)
    assert table.vehicle is None

    hear(table, system=4)

    assert table.vehicle.system_id == 4
    assert list(table.other_vehicles) == [(1, 1)]


@settings(deadline=None, derandomize=True)
@given(st.integers(0, 255), st.lists(st.integers(1, 20), min_size=1, max_size=100))
def test_losses_are_counted_by_the_sequence(start, steps):
    table = PeerTable()
    sequence = start
    for step in [0, *steps]:
        packer = Packer(1, 1)
        packer.sequence = sequence = (sequence + step) % 256
        (frame,) = Framer().feed(heartbeat_bytes(packer=packer))
        table.on_frame(frame, 1.0)

    peer = table.peers[1, 1]
    assert peer.received == len(steps) + 1
    assert peer.lost == sum(step - 1 for step in steps)
    assert peer.loss == pytest.approx(peer.lost / (peer.lost + peer.received))


def test_senders_are_counted_apart_and_a_step_back_is_no_loss():
    table = PeerTable()
    for component, sequence, time_s in [(1, 10, 1.0), (191, 200, 2.0), (1, 9, 3.0), (1, 9, 4.0)]:
        packer = Packer(1, component)
        packer.sequence = sequence
        (frame,) = Framer().feed(heartbeat_bytes(packer=packer))
        table.on_frame(frame, time_s)

    assert {key: peer.lost for key, peer in table.peers.items()} == {(1, 1): 0, (1, 191): 0}
    assert table.peers[1, 1].last_heard_s == 4.0


def test_a_wanted_component_is_waited_for_within_the_wanted_system():
    table = PeerTable(wanted_system_id=1, wanted_component_id=5)
    hear(table, system=1, component=1)
    hear(table, system=2, component=5)
    assert table.vehicle is None

    hear(table, system=1, component=5)
    hear(table, system=1, component=1)

    assert table.vehicle.target == (1, 5)
    assert table.others_text.startswith("system 1 component 1 (MAV_AUTOPILOT 12), system 2")


@pytest.mark.parametrize("other", [GROUND_STATION, COMPANION, GIMBAL])
def test_who_is_no_vehicle_is_no_other_vehicle_either(other):
    table = PeerTable()
    hear(table, system=1)

    hear(table, **other)

    assert table.others_text == ""


def test_a_component_that_made_room_for_the_autopilot_is_another_vehicle_only_once_heard_again():
    table = PeerTable()
    hear(table, system=1, component=5)
    hear(table, system=1, component=1)
    assert table.others_text == ""

    hear(table, system=1, component=5)

    assert table.vehicle.target == (1, 1)
    assert "component 5" in table.others_text


def test_what_is_overtaken_or_comes_twice_is_not_lost():
    table, packer = PeerTable(), Packer(1, 1)
    frames = [Framer().feed(heartbeat_bytes(packer=packer))[0] for _ in range(60)]
    order = [0, 1, 2, 4, 5, 6, 3, 7, 7, 8, *range(10, 60), 9]
    for time_s, at in enumerate(order):
        table.on_frame(frames[at], float(time_s))
    (peer,) = table.peers.values()
    assert (peer.received, peer.lost) == (60, 0)


def test_a_sender_that_restarts_is_counted_on():
    table = PeerTable()
    for first in (20, 0):  # back by less than half a circle, which looks like a late packet
        packer = Packer(1, 1)
        frames = [Framer().feed(heartbeat_bytes(packer=packer))[0] for _ in range(first + 80)]
        for frame in frames[first:]:
            table.on_frame(frame, 0.0)
    (peer,) = table.peers.values()
    assert peer.received == 160
    assert peer.loss < 0.02


def test_who_makes_up_many_senders_fills_no_memory():
    table = PeerTable()
    for system in range(1, 256):
        for component in (1, 2, 3, 4):
            table.on_frame(hear(table, system, component), 0.0)

    assert table.vehicle.system_id == 1
    assert len(table.peers) <= 256
    assert len(table.other_vehicles) <= 32
