"""Only what carries the right signature is read; the rest is counted and told once."""

import asyncio
import contextlib
import socket
from functools import partial

import pytest

from companion.flight.vehicle.connection import Connection
from companion.link.make import make_link
from companion.link.memory import MemoryLink
from companion.link.url import LinkUrl
from companion.mavlink.codec import Packer, encode
from companion.mavlink.framing import Framer
from companion.mavlink.messages import Outgoing, VehicleStateOfHealth, heartbeat
from companion.mavlink.peers import vehicle_heartbeat_in
from companion.mavlink.signing import EPOCH_UNIX_S, Signing
from tests.companion.link.sockets import LOOPBACK, until

KEY, OTHER_KEY = bytes(range(32)), bytes(range(1, 33))
NOW = EPOCH_UNIX_S + 1000.0
RADIO_STATUS = Outgoing(109, bytes(range(1, 10)))


class Recorded:
    def __init__(self):
        self.came, self.went = [], []

    def frame_in(self, time_s, raw):
        self.came.append(raw)

    def frame_out(self, time_s, raw):
        self.went.append(raw)


class Bench:
    def __init__(self, key):
        self.sent, self.told, self.log = [], [], Recorded()
        self.link = MemoryLink(self.sent.append)
        signing = None if key is None else Signing(key, lambda: NOW)
        self.connection = Connection(self.link, self.log, signing)
        self.connection.admission.on_rejected = self.told.append

    @property
    def vehicle_known(self):
        return self.connection.peers.vehicle is not None

    @property
    def remark(self):
        return self.connection.admission.remark(vehicle_known=self.vehicle_known)


@pytest.fixture
async def bench_of():
    async def make(key):
        bench = Bench(key)
        await bench.link.open()
        return bench

    return make


def packer(key, now=NOW):
    signer = None if key is None else Signing(key, lambda: now).signer
    return Packer(1, 1, signer)


def alive(sender):
    return sender.pack(
        encode("HEARTBEAT", type=2, autopilot=12, base_mode=0, custom_mode=0, system_status=3,
               mavlink_version=3)
    )  # fmt: skip


async def test_a_signed_vehicle_is_heard_and_answered_with_signatures(bench_of):
    bench = await bench_of(KEY)

    bench.link.receive(alive(packer(KEY)))
    bench.connection.send(heartbeat(VehicleStateOfHealth.ACTIVE))

    assert bench.vehicle_known
    assert bench.connection.admission.rejected == {}
    (frame,) = Framer().feed(bench.sent[0])
    assert Signing(KEY, lambda: NOW).verifier.check(frame) is None
    assert bench.told == []
    assert bench.remark == ""


@pytest.mark.parametrize(
    ("theirs", "now", "reason", "says"),
    [
        (None, NOW, "unsigned", "3 packets were not read because they are not signed: give the"),
        (OTHER_KEY, NOW, "badly signed", "3 packets were not read because their signatures are no"),
        (KEY, NOW - 61.0, "outdated", "3 packets were not read because they are stamped more than"),
    ],
)
async def test_what_is_not_let_in_is_not_even_recorded(bench_of, theirs, now, reason, says):
    bench = await bench_of(KEY)
    vehicle = packer(theirs, now)

    for _ in range(3):
        bench.link.receive(alive(vehicle))

    assert not bench.vehicle_known
    assert bench.connection.peers.peers == {}
    assert bench.log.came == []
    assert bench.connection.admission.rejected == {reason: 3}
    assert len(bench.told) == 1
    assert bench.told[0].startswith("a packet (message 0) of 1/1 was not read, as all such will")
    assert bench.remark.startswith(says)


@contextlib.asynccontextmanager
async def listening(scheme, key):
    """A connection that waits for the vehicle, and the port it waits at."""
    signing = Signing(key, lambda: NOW)
    link = make_link(
        LinkUrl(scheme, LOOPBACK, 0), partial(vehicle_heartbeat_in, verifier=signing.verifier)
    )
    connection = Connection(link, Recorded(), signing)
    await link.open()
    try:
        yield connection, link.local[1]
    finally:
        link.close()


@pytest.mark.parametrize(
    ("theirs", "reason", "says"),
    [(None, "unsigned", "they are not signed"), (OTHER_KEY, "badly signed", "by our key")],
)
@pytest.mark.parametrize("scheme", ["udpin", "tcpin"])
async def test_a_caller_who_is_not_taken_for_the_peer_is_counted_by_the_reason(
    scheme, theirs, reason, says
):
    vehicle, stranger = packer(theirs), Packer(255, 190)
    async with listening(scheme, KEY) as (connection, port):
        told = []
        connection.admission.on_rejected = told.append
        kind = socket.SOCK_DGRAM if scheme == "udpin" else socket.SOCK_STREAM
        with socket.socket(socket.AF_INET, kind) as caller:
            caller.connect((LOOPBACK, port))
            for count in (1, 2, 3):
                caller.send(alive(vehicle))
                await until(lambda count=count: connection.admission.rejected == {reason: count})
                # Looked at together with what was said before, it counts no second time.
                caller.send(stranger.pack(heartbeat(VehicleStateOfHealth.ACTIVE)))
            await asyncio.sleep(0.02)

        assert connection.admission.rejected == {reason: 3}
        assert says in connection.admission.remark(vehicle_known=False)
        assert len(told) == 1


async def test_a_recorded_packet_sent_again_changes_nothing(bench_of):
    bench = await bench_of(KEY)
    raw = alive(packer(KEY))

    bench.link.receive(raw)
    bench.link.receive(raw)

    assert bench.connection.peers.peers[(1, 1)].received == 1
    assert bench.connection.admission.rejected == {"replayed": 1}
    assert bench.log.came == [raw]
    assert bench.remark == ""  # the vehicle was found: this did not keep it away


async def test_a_radios_reports_are_read_unsigned(bench_of):
    bench = await bench_of(KEY)

    bench.link.receive(Packer(51, 68).pack(RADIO_STATUS))

    assert (51, 68) in bench.connection.peers.peers
    assert bench.connection.admission.rejected == {}


async def test_without_a_key_everything_is_read_and_a_signing_vehicle_is_told_of(bench_of):
    bench = await bench_of(None)
    vehicle = packer(OTHER_KEY)

    bench.link.receive(alive(vehicle))
    bench.link.receive(alive(vehicle))

    assert bench.vehicle_known
    assert not bench.connection.admission.checks
    (told,) = bench.told
    assert told.startswith("The autopilot's packets are signed, and no key was given here")
    assert bench.remark == told


async def test_without_a_key_an_unsigned_vehicle_is_nothing_to_talk_of(bench_of):
    bench = await bench_of(None)

    bench.link.receive(alive(packer(None)))

    assert bench.told == []
    assert bench.remark == ""


@pytest.mark.parametrize("key", [KEY, None])
async def test_a_frame_of_somebody_else_goes_out_under_our_signature(bench_of, key):
    bench = await bench_of(key)
    (frame,) = Framer().feed(Packer(255, 190).pack(heartbeat(VehicleStateOfHealth.ACTIVE)))

    bench.connection.send_frame(frame)

    (sent,) = Framer().feed(bench.sent[0])
    assert sent.signed == (key is not None)
    assert (sent.system_id, sent.component_id, sent.payload) == (255, 190, frame.payload)
    if key is not None:
        assert Signing(key, lambda: NOW).verifier.check(sent) is None
    assert bench.log.went == bench.sent
