"""Frames between the vehicle and clients: who gets what, and what is answered in its place."""

import asyncio
import contextlib
import math
import socket

import pytest

from companion.config.link_models import ForwardConfig
from companion.flight.shared_link.endpoints import datagrams_of
from companion.flight.shared_link.forwarding import Forwarder
from companion.flight.vehicle.connection import Connection
from companion.link.link import LinkError
from companion.link.memory import MemoryLink
from companion.mavlink.codec import Packer, decode, encode
from companion.mavlink.commands import Command, arm, disarm, message_interval
from companion.mavlink.framing import Framer
from companion.mavlink.messages import (
    COMPONENT_TRUTH,
    Severity,
    Target,
    VehicleStateOfHealth,
    heartbeat,
)
from tests.companion.link.sockets import LOOPBACK, until

VEHICLE = Target(1, 1)
ALIVE = heartbeat(VehicleStateOfHealth.ACTIVE)


class NoLog:
    def frame_in(self, time_s, raw):
        pass

    def frame_out(self, time_s, raw):
        pass


class Client:
    """A program over UDP that speaks MAVLink."""

    def __init__(self, port, system=255, component=190):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((LOOPBACK, 0))
        self.socket.connect((LOOPBACK, port))
        self.socket.setblocking(False)
        self.packer = Packer(system, component)
        self.frames = []

    def say(self, *outgoings):
        self.socket.send(b"".join(self.packer.pack(outgoing) for outgoing in outgoings))

    def hears(self):
        with contextlib.suppress(BlockingIOError, ConnectionError):
            while True:
                self.frames += Framer().feed(self.socket.recv(4096))
        return self.frames

    def names(self):
        return [decode(frame).get_type() for frame in self.hears()]

    def acks(self):
        messages = [decode(frame) for frame in self.hears() if frame.message_id == 77]
        return [(ack.command, ack.result) for ack in messages]


class Vehicle:
    """The other end of a link in memory, and what reached it."""

    def __init__(self):
        self.packer = Packer(*VEHICLE)
        self.framer = Framer()
        self.frames = []
        self.link = MemoryLink(lambda data: self.frames.extend(self.framer.feed(data)))

    def say(self, *outgoings, packer=None):
        for outgoing in outgoings:
            self.link.receive((packer or self.packer).pack(outgoing))

    def heartbeat(self, *, armed=True, autopilot=12):
        self.say(
            encode(
                "HEARTBEAT",
                type=2, autopilot=autopilot, base_mode=0x81 if armed else 1,
                custom_mode=0x00060000, system_status=4, mavlink_version=3,
            )
        )  # fmt: skip

    def heard(self, system=255):
        """Names of what a system has said to it."""
        return [decode(f).get_type() for f in self.frames if f.system_id == system]


class Stage:
    """A connection with endpoints, and what was told."""

    def __init__(self, vehicle, endpoints):
        self.vehicle = vehicle
        self.connection = Connection(vehicle.link, NoLog())
        self.told = []
        self.pilot_flies = False
        self.forwarder = Forwarder(
            self.connection,
            endpoints,
            lambda severity, text: self.told.append((severity, text)),
            lambda: self.pilot_flies,
            self.pause,
        )
        self.paused = 0
        self.can_pause = True

    def pause(self):
        self.paused += self.can_pause
        return self.can_pause

    def port(self, index=0):
        return self.forwarder.endpoints[index].clients.local[1]

    def chores(self, count=1):
        now = asyncio.get_running_loop().time()
        for _ in range(count):
            for chore in self.connection.chores:
                chore(now)


@contextlib.asynccontextmanager
async def on_stage(*endpoints, **heartbeat_fields):
    vehicle = Vehicle()
    endpoints = endpoints or (ForwardConfig(url=f"udpin://{LOOPBACK}:0"),)
    stage = Stage(vehicle, endpoints)
    await vehicle.link.open()
    vehicle.heartbeat(**heartbeat_fields)
    await stage.forwarder.open()
    try:
        yield stage
    finally:
        stage.forwarder.close()


@contextlib.asynccontextmanager
async def client_of(stage, index=0, **address):
    client = Client(stage.port(index), **address)
    before = len(stage.vehicle.frames)
    client.say(ALIVE)
    await until(lambda: len(stage.vehicle.frames) > before)
    try:
        yield client
    finally:
        client.socket.close()


def local(**allowed):
    return ForwardConfig(url=f"udpin://{LOOPBACK}:0", **allowed)


SETPOINT = encode(
    "SET_ATTITUDE_TARGET",
    time_boot_ms=0, target_system=1, target_component=1, type_mask=7, q=[1, 0, 0, 0],
    body_roll_rate=0, body_pitch_rate=0, body_yaw_rate=0, thrust=0.5,
)  # fmt: skip
ATTITUDE = encode(
    "ATTITUDE", time_boot_ms=1, roll=0, pitch=0, yaw=0, rollspeed=0, pitchspeed=0, yawspeed=0
)


async def test_what_the_vehicle_sends_reaches_every_client_as_it_was():
    async with (
        on_stage(local(), local()) as stage,
        client_of(stage, 0) as one,
        client_of(stage, 1, component=191) as two,
    ):
        stage.vehicle.say(ATTITUDE)
        await until(lambda: "ATTITUDE" in one.names() and "ATTITUDE" in two.names())

        raw = next(frame.raw for frame in one.frames if frame.message_id == 30)
        again = Packer(*VEHICLE)
        again.sequence = 1
        assert raw == again.pack(ATTITUDE)


async def test_the_truth_is_forwarded_only_if_asked_for():
    async with (
        on_stage(local(), local(truth=True)) as stage,
        client_of(stage, 0) as blind,
        client_of(stage, 1) as seeing,
    ):
        stage.vehicle.say(ATTITUDE, packer=Packer(1, COMPONENT_TRUTH))
        stage.vehicle.heartbeat()
        await until(lambda: "HEARTBEAT" in blind.names() and "ATTITUDE" in seeing.names())

        assert "ATTITUDE" not in blind.names()


async def test_clients_see_each_other_and_the_vehicle_sees_them_but_none_itself():
    async with (
        on_stage(local(), local()) as stage,
        client_of(stage, 0) as one,
        client_of(stage, 0, component=191) as two,
        client_of(stage, 1, component=192) as three,
    ):
        one.say(encode("PING", time_usec=1, seq=1, target_system=0, target_component=0))
        await until(lambda: "PING" in two.names() and "PING" in three.names())

        assert "PING" not in one.names()
        assert "PING" in stage.vehicle.heard()


async def test_what_the_companion_says_reaches_clients_and_what_it_commands_does_not():
    async with on_stage() as stage, client_of(stage) as client:
        stage.connection.send(arm(VEHICLE).as_long())
        stage.connection.send(ALIVE)
        stage.connection.say(Severity.WARNING, "companion: hello")
        await until(lambda: "STATUSTEXT" in client.names())

        assert client.names() == ["HEARTBEAT", "STATUSTEXT"]


async def test_a_refused_command_is_answered_counted_and_told_once():
    async with on_stage() as stage, client_of(stage) as client:
        for _ in range(3):
            client.say(arm(VEHICLE).as_long())
        await until(lambda: len(client.acks()) == 3)

        assert client.acks() == [(400, 2)] * 3
        ack = client.frames[-1]
        assert (ack.system_id, ack.component_id) == VEHICLE
        assert decode(ack).target_system == 255
        assert stage.forwarder.refused == {"COMPONENT_ARM_DISARM": 3}
        warnings = [text for severity, text in stage.told if severity == "warning"]
        assert len(warnings) == 1
        assert "COMPONENT_ARM_DISARM of 255/190 not passed on: the companion arms" in warnings[0]
        assert "COMMAND_LONG" not in stage.vehicle.heard()


async def test_a_pilot_can_always_disarm():
    async with on_stage() as stage, client_of(stage) as client:
        client.say(disarm(VEHICLE, force=True).as_long())
        await until(lambda: "COMMAND_LONG" in stage.vehicle.heard())


async def test_setpoints_are_kept_back_unless_allowed():
    async with (
        on_stage(local(), local(allow_setpoints=True)) as stage,
        client_of(stage, 0) as tame,
        client_of(stage, 1, system=254) as trusted,
    ):
        tame.say(SETPOINT)
        trusted.say(SETPOINT)
        await until(lambda: "SET_ATTITUDE_TARGET" in stage.vehicle.heard(254))
        await until(lambda: stage.forwarder.refused)

        assert "SET_ATTITUDE_TARGET" not in stage.vehicle.heard(255)


async def test_commands_pass_where_allowed_and_once_a_pilot_flies():
    async with (
        on_stage(local(), local(allow_commands=True)) as stage,
        client_of(stage, 0) as pilot,
        client_of(stage, 1, system=254) as trusted,
    ):
        trusted.say(arm(VEHICLE).as_long())
        await until(lambda: "COMMAND_LONG" in stage.vehicle.heard(254))
        stage.pilot_flies = True
        pilot.say(arm(VEHICLE).as_long())
        await until(lambda: "COMMAND_LONG" in stage.vehicle.heard(255))


@pytest.mark.parametrize("address", [(1, 1), (1, 191)])
async def test_nobody_speaks_as_the_vehicle_or_the_companion(address):
    async with on_stage() as stage:
        liar = Client(stage.port(), *address)
        liar.say(arm(VEHICLE).as_long(), ALIVE)
        await until(lambda: stage.forwarder.refused.get("messages") == 2)

        assert not stage.vehicle.frames
        assert any("address" in text for _, text in stage.told)
        liar.socket.close()


async def test_a_parameter_set_in_flight_is_answered_with_what_it_stays():
    async with on_stage() as stage, client_of(stage) as client:
        client.say(
            encode(
                "PARAM_SET",
                target_system=1, target_component=1, param_id=b"COM_OF_LOSS_T",
                param_value=30.0, param_type=9,
            )
        )  # fmt: skip
        await until(lambda: stage.forwarder.refused)
        stage.chores()

        asked = decode(stage.vehicle.frames[-1])
        assert asked.get_type() == "PARAM_REQUEST_READ"
        assert (asked.param_id, asked.param_index) == ("COM_OF_LOSS_T", -1)
        assert "PARAM_SET" not in stage.vehicle.heard()


def file_operation(operation):
    payload = bytearray(251)
    payload[:5] = b"\x07\x00\x03" + bytes((operation, 20))
    return encode(
        "FILE_TRANSFER_PROTOCOL",
        target_network=0, target_system=1, target_component=1, payload=list(payload),
    )  # fmt: skip


async def test_a_file_that_would_be_written_in_flight_is_answered_with_a_nak():
    async with on_stage() as stage, client_of(stage) as client:
        client.say(file_operation(6), file_operation(4))
        await until(lambda: "FILE_TRANSFER_PROTOCOL" in client.names())

        (answer,) = [frame for frame in client.frames if frame.message_id == 110]
        assert (answer.system_id, answer.component_id) == VEHICLE
        nak = decode(answer)
        assert (nak.target_system, nak.target_component) == (255, 190)
        # Sequence 8, session 3, NAK, one byte, of "create", which says "file protected".
        assert list(nak.payload[:6]) == [8, 0, 3, 129, 1, 6]
        assert nak.payload[12] == 9
        assert stage.vehicle.heard().count("FILE_TRANSFER_PROTOCOL") == 1


async def test_a_fence_that_would_be_uploaded_in_flight_is_answered_by_the_missions_service():
    fence = encode("MISSION_COUNT", target_system=1, target_component=1, count=4, mission_type=1)
    async with on_stage() as stage, client_of(stage) as client:
        client.say(fence)
        await until(lambda: "MISSION_ACK" in client.names())

        ack = decode(client.frames[-1])
        assert (ack.target_system, ack.target_component) == (255, 190)
        assert (ack.type, ack.mission_type) == (14, 1)
        assert "MISSION_COUNT" not in stage.vehicle.heard()


async def test_an_extended_parameter_is_denied_in_flight():
    wanted = encode(
        "PARAM_EXT_SET",
        target_system=1, target_component=1, param_id=b"SPEED", param_value=b"7", param_type=9,
    )  # fmt: skip
    async with on_stage() as stage, client_of(stage) as client:
        client.say(wanted)
        await until(lambda: "PARAM_EXT_ACK" in client.names())

        ack = decode(client.frames[-1])
        assert (ack.param_id, ack.param_value, ack.param_type) == ("SPEED", "7", 9)
        assert ack.param_result == 3


async def test_the_vehicle_hears_of_one_clock_alone():
    question = encode("TIMESYNC", tc1=0, ts1=5)
    answer = encode("TIMESYNC", tc1=77, ts1=5)
    async with on_stage() as stage, client_of(stage) as client:
        stage.pilot_flies = True
        client.say(answer, question)
        await until(lambda: "TIMESYNC" in stage.vehicle.heard())

        (passed,) = [f for f in stage.vehicle.frames if f.message_id == 111]
        assert decode(passed).tc1 == 0
        assert not stage.forwarder.refused, "nobody needs to know"


PAUSES = [
    Command(193, VEHICLE, (0.0,) * 7),
    Command(252, VEHICLE, (0.0,) * 7),
    Command(192, VEHICLE, (-1.0, 1.0, 0.0, *[math.nan] * 4)),
]


@pytest.mark.parametrize("command", PAUSES)
async def test_a_pause_that_ardupilot_would_deny_is_the_companions_own_hand_over(command):
    async with on_stage(autopilot=3) as stage, client_of(stage) as client:
        client.say(command.as_long())
        await until(client.acks)

        assert client.acks() == [(command.command_id, 0)]
        assert stage.paused == 1
        assert "COMMAND_LONG" not in stage.vehicle.heard()

        stage.can_pause = False
        client.say(command.as_long())
        await until(lambda: len(client.acks()) == 2)
        assert client.acks()[1] == (command.command_id, 2)
        assert any("choose mode brake, land or loiter" in text for _, text in stage.told)


async def test_a_client_cannot_blind_the_companion():
    async with on_stage(autopilot=3) as stage, client_of(stage) as client:
        client.say(message_interval(VEHICLE, 0, None).as_long())
        await until(client.acks)

        assert client.acks() == [(511, 2)]
        assert "COMMAND_LONG" not in stage.vehicle.heard()


async def test_a_client_cannot_slow_down_what_the_flight_needs():
    async with on_stage() as stage, client_of(stage) as client:
        stage.connection.send(message_interval(VEHICLE, 331, 0.01).as_long())
        before = len(stage.vehicle.frames)
        client.say(message_interval(VEHICLE, 331, 1.0).as_long())
        client.say(message_interval(VEHICLE, 30, 1.0).as_long())
        await until(lambda: len(stage.vehicle.frames) > before and client.acks())

        assert client.acks() == [(511, 0)]
        assert decode(stage.vehicle.frames[-1]).param1 == 30.0
        assert len(stage.vehicle.frames) == before + 1


DATA_STREAM = encode(
    "REQUEST_DATA_STREAM",
    target_system=1, target_component=1, req_stream_id=0, req_message_rate=4, start_stop=1,
)  # fmt: skip


async def test_a_legacy_request_for_streams_never_reaches_the_vehicle_as_it_is():
    async with on_stage(autopilot=3) as stage, client_of(stage) as client:
        stage.connection.send(message_interval(VEHICLE, 32, 0.01).as_long())
        client.say(DATA_STREAM, ALIVE)
        await until(lambda: stage.vehicle.heard().count("HEARTBEAT") == 2)
        before = len(stage.vehicle.frames)
        stage.chores()
        assert len(stage.vehicle.frames) == before + 2, "a few at a time"
        stage.chores(20)

        asked = [decode(f) for f in stage.vehicle.frames[before:]]
        assert {m.get_type() for m in asked} == {"COMMAND_LONG"}
        wanted = [int(m.param1) for m in asked]
        assert 30 in wanted
        assert 32 not in wanted
        assert all(m.get_srcComponent() == 192 for m in asked)
        assert "REQUEST_DATA_STREAM" not in stage.vehicle.heard()

        def ack(component):
            return encode(
                "COMMAND_ACK",
                command=511, result=0, target_system=1, target_component=component,
            )  # fmt: skip

        stage.vehicle.say(ack(192), ack(191), ATTITUDE)
        await until(lambda: "ATTITUDE" in client.names())
        assert client.names().count("COMMAND_ACK") == 1, "clients asked nothing of that kind"


async def test_a_client_that_says_too_much_does_not_flood_the_vehicle():
    async with on_stage() as stage, client_of(stage) as client:
        for _ in range(40):
            client.say(*[ALIVE] * 60)
            await asyncio.sleep(0)
        await until(lambda: sum(stage.forwarder.refused.values()) > 10)

        assert sum(len(frame.raw) for frame in stage.vehicle.frames) < 40_000
        assert any("says more than" in text for _, text in stage.told)


async def test_noise_makes_no_client_and_harms_nobody():
    async with on_stage() as stage, client_of(stage) as client:
        noisy = Client(stage.port())
        noisy.socket.send(b"GET / HTTP/1.1\r\n\r\n")
        client.socket.send(b"\xfd" * 200)
        client.say(encode("PING", time_usec=1, seq=1, target_system=0, target_component=0))
        await until(lambda: "PING" in stage.vehicle.heard())

        assert len(stage.forwarder.endpoints[0].clients.present()) == 1
        noisy.socket.close()


async def test_a_tcp_client_that_reads_nothing_is_skipped_and_the_others_are_not():
    async with on_stage(ForwardConfig(url=f"tcpin://{LOOPBACK}:0"), local()) as stage:
        _, lazy = await asyncio.open_connection(LOOPBACK, stage.port(0), limit=1024)
        lazy.transport.pause_reading()
        lazy.write(Packer(254, 190).pack(ALIVE))
        await until(lambda: "HEARTBEAT" in stage.vehicle.heard(254))
        async with client_of(stage, 1) as client:
            frames = Framer().feed(Packer(*VEHICLE).pack(ATTITUDE)) * 100
            for _ in range(200):
                stage.connection.on_frames(frames)  # past the intake, which drops a flood
                client.hears()
                await asyncio.sleep(0)
            await until(lambda: stage.forwarder.endpoints[0].unsent > 0)

            assert client.names().count("ATTITUDE") > 15_000
            (waiting,) = stage.forwarder.endpoints[0].clients._clients
            assert waiting._waiting() <= 1 << 16
        lazy.close()


async def test_udpout_speaks_first_and_does_not_mind_who_is_not_there():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
        station.bind((LOOPBACK, 0))
        port = station.getsockname()[1]
    endpoint = ForwardConfig(url=f"udpout://{LOOPBACK}:{port}")
    async with on_stage(endpoint) as stage:
        for _ in range(10):
            stage.vehicle.heartbeat()
            await asyncio.sleep(0)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
            station.bind((LOOPBACK, port))
            station.setblocking(False)
            stage.vehicle.heartbeat()
            data, came_from = await asyncio.wait_for(
                asyncio.get_running_loop().sock_recvfrom(station, 2048), 5
            )
            station.sendto(Packer(255, 190).pack(ALIVE), came_from)
            await until(stage.vehicle.heard)

            assert Framer().feed(data)[0].message_id == 0


@pytest.mark.parametrize("url", ["udpin://0.0.0.0:14550", "udpout://192.0.2.7:14550"])
async def test_an_endpoint_open_to_the_network_must_be_meant(url):
    vehicle = Vehicle()
    with pytest.raises(LinkError, match="remote: true"):
        Stage(vehicle, [ForwardConfig(url=url)])

    stage = Stage(vehicle, [ForwardConfig(url="udpin://0.0.0.0:0", remote=True)])
    await stage.forwarder.open()
    stage.forwarder.close()
    assert any("open to the network" in text for severity, text in stage.told)


@pytest.mark.parametrize("url", ["tcpout://127.0.0.1:5760", "serial:///dev/ttyUSB0:57600"])
def test_what_can_be_no_endpoint_is_refused(url):
    with pytest.raises(LinkError, match="cannot be forwarded to"):
        Stage(Vehicle(), [ForwardConfig(url=url)])


async def test_an_endpoint_whose_port_is_taken_closes_the_others_again():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind((LOOPBACK, 0))
        port = taken.getsockname()[1]
        stage = Stage(Vehicle(), [local(), ForwardConfig(url=f"udpin://{LOOPBACK}:{port}")])
        with pytest.raises(LinkError, match="in use"):
            await stage.forwarder.open()

        assert stage.forwarder.endpoints[0].clients._transport is None
        assert stage.connection.on_frames is None


def test_packets_that_came_at_once_leave_together_but_not_too_large():
    raws = [bytes([n]) * 280 for n in range(10)]

    together = datagrams_of(raws)

    assert b"".join(together) == b"".join(raws)
    assert [len(data) for data in together] == [1400, 1400]
    assert datagrams_of([]) == []
