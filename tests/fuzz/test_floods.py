"""Floods over real sockets: what comes out, what a round of the loop does, what is told."""

import asyncio
import contextlib
import os
import socket
import tty
from functools import partial

import pytest

from companion.flight.vehicle.connection import Connection
from companion.flight.vehicle.intake import BUDGET_BYTES, HELD_BYTES, RESERVE, STATE_CHARGE
from companion.link.serial_port import SerialLink
from companion.link.tcp import TcpInLink
from companion.link.udp import UdpLink
from companion.link.url import parse_link_url
from companion.mavlink.codec import Packer, encode
from companion.mavlink.peers import vehicle_heartbeat_in

LOOPBACK = "127.0.0.1"
FLOOD = 50_000
ROUND_S = 0.01
AT_ONCE = 250
"""Sent between two rounds of the loop: more than a turn's budget, less than any system keeps."""
HEARTBEAT = Packer(1, 1).pack(
    encode(
        "HEARTBEAT",
        type=2, autopilot=12, base_mode=1, custom_mode=7, system_status=4, mavlink_version=3,
    )
)  # fmt: skip
BABBLE = Packer(1, 1).pack(encode("NAMED_VALUE_INT", time_boot_ms=1, name=b"babble", value=7))
PER_TURN = BUDGET_BYTES // 80


def odometry(number, packer):
    zeros = [0.0] * 21
    return packer.pack(
        encode(
            "ODOMETRY",
            time_usec=number * 1000, frame_id=1, child_frame_id=1, x=float(number % 100), y=0.0,
            z=-1.0, q=[1.0, 0.0, 0.0, 0.0], vx=0.0, vy=0.0, vz=0.0, rollspeed=0.0, pitchspeed=0.0,
            yawspeed=0.0, pose_covariance=zeros, velocity_covariance=zeros, reset_counter=0,
            estimator_type=0, quality=100,
        )
    )  # fmt: skip


class Log:
    def __init__(self):
        self.frames = 0

    def frame_in(self, time_s, raw):
        self.frames += 1

    def frame_out(self, time_s, raw):
        pass


class Vehicle:
    """A socket that says much, and the connection that hears it."""

    def __init__(self, link, sock, address=None):
        self.link = link
        self.socket = sock
        self.address = address
        self.log = Log()
        self.connection = Connection(link, self.log)
        self.now_s = 0.0
        self.told = []
        self.troubles = []
        self.samples = []
        self.connection.reception.on_flood = self.told.append
        self.connection.on_trouble = self.troubles.append
        self.connection.samples.on_sample = lambda state, now_s: self.samples.append(state)

    def say(self, data):
        if self.address is None:
            self.socket.send(data)
        else:
            self.socket.sendto(data, self.address)


async def one_round(vehicle=None):
    """Let the loop go round once; by a vehicle's clock that takes 10 ms."""
    if vehicle is not None:
        vehicle.now_s += ROUND_S
    await asyncio.sleep(0)


async def rounds(until_true, most=100_000, vehicle=None):
    """Let the loop go round; how often it did."""
    for count in range(most):
        if until_true():
            return count
        await one_round(vehicle)
    raise AssertionError("it never came about")


@pytest.fixture
async def vehicle(monkeypatch):
    """Its clock is the loop's: how busy this computer is must not make pauses of its own."""
    link = UdpLink(parse_link_url(f"udpin://{LOOPBACK}:0"), vehicle_heartbeat_in)
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made = Vehicle(link, sock)
    monkeypatch.setattr(asyncio.get_running_loop(), "time", lambda: made.now_s)
    await link.open()
    made.address = (LOOPBACK, link.local[1])
    sock.bind((LOOPBACK, 0))
    made.say(HEARTBEAT)
    await rounds(lambda: made.connection.peers.vehicle is not None, vehicle=made)
    yield made
    link.close()
    sock.close()


async def flood_of(vehicle, say, packet_of):
    """Say 50,000 packets, the loop going round in between; the most that a round dealt with."""
    most = 0
    for start in range(0, FLOOD, AT_ONCE):
        for number in range(start, start + AT_ONCE):
            say(packet_of(number))
        for _ in range(2):
            before = vehicle.log.frames
            await one_round(vehicle)
            most = max(most, vehicle.log.frames - before)
    return most


async def test_a_flood_of_a_stranger_is_dropped_by_its_address_and_the_state_passes(vehicle):
    looked_at = []
    accept = vehicle.link._accept_peer
    vehicle.link._accept_peer = lambda data: looked_at.append(data) or accept(data)
    packer = Packer(1, 1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for start in range(0, FLOOD, AT_ONCE):
            for _ in range(AT_ONCE):
                stranger.sendto(HEARTBEAT, vehicle.address)
            vehicle.say(odometry(start, packer))
            await rounds(lambda start=start: vehicle.samples[-1:] and vehicle.samples[-1].time_s
                         == pytest.approx(start * 1e-3), vehicle=vehicle)  # fmt: skip

    assert vehicle.link.counters.foreign_packets == FLOOD
    assert looked_at == [], "not one was parsed"
    assert vehicle.connection.framer.looks == 1 + FLOOD // AT_ONCE
    assert vehicle.link.counters.excess_packets == 0
    assert vehicle.told == []


async def test_a_flood_of_states_from_the_peer_ends_with_the_newest(vehicle):
    packer = Packer(1, 1)

    most = await flood_of(vehicle, vehicle.say, partial(odometry, packer=packer))
    last = (FLOOD - 1) * 1e-3
    await rounds(
        lambda: vehicle.samples and vehicle.samples[-1].time_s == pytest.approx(last),
        vehicle=vehicle,
    )

    # In a round a turn may end and another begin.
    assert most <= 2 * (BUDGET_BYTES // STATE_CHARGE + RESERVE) + 2
    times = [state.time_s for state in vehicle.samples]
    assert times == sorted(times)
    counters = vehicle.link.counters
    assert counters.packets_in == FLOOD + 1
    assert counters.excess_packets > FLOOD // 2
    assert len(vehicle.told) == 1
    assert str(counters.excess_packets) in vehicle.connection.reception.flood_remark
    assert vehicle.troubles == []


@pytest.mark.parametrize("stall_s", [0.12, 0.25])
async def test_what_piled_up_while_the_companion_stood_still_is_all_dealt_with(vehicle, stall_s):
    """Of ordinary traffic, 141 kB/s as it is charged."""
    packer = Packer(1, 1)
    states, others = round(170 * stall_s), round(675 * stall_s)
    said = [odometry(1 + number, packer) for number in range(states)]
    said += [BABBLE] * others
    for _ in range(3):
        vehicle.now_s += stall_s
        for packet in said:
            vehicle.say(packet)
        for _ in range(10):
            await one_round(vehicle)

    assert vehicle.log.frames == 1 + 3 * len(said), "all of it is in the recording"
    assert vehicle.told == []
    assert vehicle.connection.reception.flood_remark == ""


async def test_more_than_can_be_made_up_for_is_not_blamed_on_the_vehicle(vehicle):
    for number in range(3):
        vehicle.now_s += 3.0
        for _ in range(10):
            vehicle.connection.reception.take(BABBLE * 250, vehicle.now_s)
        vehicle.connection.reception.take(odometry(1 + number, Packer(1, 1)), vehicle.now_s)
        for _ in range(10):
            await one_round(vehicle)

    assert [state.time_s for state in vehicle.samples] == pytest.approx([0.001, 0.002, 0.003])
    assert vehicle.link.counters.excess_packets > 0
    assert vehicle.told == []
    remark = vehicle.connection.reception.flood_remark
    assert "while the companion or the link stood still" in remark
    assert "floods" not in remark


async def test_a_babbling_peer_costs_no_state_and_no_round_of_the_loop(vehicle):
    packer = Packer(1, 1)
    woken = 0

    async def timers():
        nonlocal woken
        while True:
            woken += 1
            await asyncio.sleep(0)

    task = asyncio.create_task(timers())
    states = 0

    def packet_of(number):
        nonlocal states
        if (number + 1) % 1000:
            return BABBLE
        states += 1
        return odometry(number, packer)

    most = await flood_of(vehicle, vehicle.say, packet_of)
    last = (FLOOD - 1) * 1e-3
    await rounds(
        lambda: vehicle.samples and vehicle.samples[-1].time_s == pytest.approx(last),
        vehicle=vehicle,
    )
    task.cancel()

    assert most <= 2 * (PER_TURN + RESERVE)
    assert woken >= 2 * FLOOD // AT_ONCE, "timers have had their turns"
    assert 0 < len(vehicle.samples) <= states
    assert vehicle.link.counters.excess_packets > 0
    assert vehicle.log.frames < FLOOD - FLOOD // AT_ONCE * (AT_ONCE - PER_TURN - RESERVE)


async def test_a_heartbeat_and_an_answer_within_a_flood_are_not_lost(vehicle):
    acks = []
    vehicle.connection.exchanges.on_ack = lambda now_s, ack: acks.append(ack.command_id)
    beats = vehicle.connection.reports.heartbeats
    answer = Packer(1, 1).pack(encode("COMMAND_ACK", command=511, result=0))
    for number in range(4000):
        vehicle.say(BABBLE if number != 2000 else HEARTBEAT + answer)
        if number % 500 == 0:
            await asyncio.sleep(0)
    await rounds(lambda: acks, vehicle=vehicle)

    assert acks == [511]
    assert vehicle.connection.reports.heartbeats == beats + 1


async def test_a_flood_over_tcp_is_read_to_its_end_and_the_newest_state_comes_out():
    link = TcpInLink(parse_link_url(f"tcpin://{LOOPBACK}:0"), vehicle_heartbeat_in)
    made = Vehicle(link, None)
    await link.open()
    _, writer = await asyncio.open_connection(LOOPBACK, link.local[1])
    packer = Packer(1, 1)
    try:
        writer.write(HEARTBEAT)
        await rounds(lambda: made.connection.peers.vehicle is not None)
        for start in range(0, FLOOD, AT_ONCE):
            writer.write(BABBLE * AT_ONCE + odometry(start, packer))
            await writer.drain()
        writer.write(b"".join(odometry(FLOOD + i, packer) for i in range(500)))
        last = (FLOOD + 499) * 1e-3
        await rounds(lambda: made.samples and made.samples[-1].time_s == pytest.approx(last))

        counters = link.counters
        length = len(BABBLE) * FLOOD
        assert counters.bytes_in > length
        assert counters.excess_bytes + counters.excess_packets * len(BABBLE) > length // 2
        assert made.connection.framer.pending_bytes <= 280
        assert made.connection.reception.held_bytes <= HELD_BYTES
        assert made.troubles == []
    finally:
        writer.close()
        link.close()


async def test_strangers_get_a_bounded_hearing_while_nobody_is_the_peer():
    looked_at = []

    def accept(data):
        looked_at.append(data)
        return vehicle_heartbeat_in(data)

    link = UdpLink(parse_link_url(f"udpin://{LOOPBACK}:0"), accept)
    for number in range(FLOOD):
        link.take(b"\xfe" * 279, ("192.0.2.9", 1 + number % 100), 1.0)
    assert len(looked_at) == 50
    assert link.counters.foreign_packets == FLOOD

    link.take(HEARTBEAT, ("192.0.2.1", 14580), 1.02)

    assert link.peer == ("192.0.2.1", 14580)


async def test_a_flood_over_a_serial_line_is_read_to_its_end_and_the_newest_state_comes_out():
    ours, theirs = os.openpty()
    tty.setraw(ours)
    os.set_blocking(ours, False)
    link = SerialLink(parse_link_url(f"serial://{os.ttyname(theirs)}:921600"))
    made = Vehicle(link, None)
    packer = Packer(1, 1)
    try:
        await link.open()
        flood = HEARTBEAT + b"".join(
            BABBLE * 500 + odometry(number, packer) for number in range(40)
        )
        position = 0
        for _ in range(100_000):
            with contextlib.suppress(BlockingIOError):
                position += os.write(ours, flood[position : position + 65_536])
            await asyncio.sleep(0)
            if made.samples and made.samples[-1].time_s == pytest.approx(39e-3):
                break

        assert position == len(flood)
        assert made.samples[-1].time_s == pytest.approx(39e-3)
        assert link.counters.bytes_in == len(flood)
        assert made.connection.reception.held_bytes <= HELD_BYTES
        assert made.troubles == []
    finally:
        link.close()
        os.close(ours)
        os.close(theirs)
