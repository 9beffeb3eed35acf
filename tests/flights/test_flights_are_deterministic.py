"""One seed, one flight, byte for byte; and nothing of the truth reaches the controller."""

import numpy as np
import pytest

from companion.mavlink.framing import Framer
from companion.mavlink.messages import COMPONENT_TRUTH, MessageId
from companion.recording.tlog import read_tlog
from tests.flights.bench import Bench

GUSTS = {"wind": "gusts"}
"""So that everything random takes part."""


@pytest.fixture(scope="module")
def fly(tmp_path_factory):
    def fly_once(name, from_shim=None, **options):
        bench = Bench(tmp_path_factory.mktemp(name))
        bench.wire.from_shim = from_shim
        return bench.fly(options=GUSTS | options)

    return fly_once


@pytest.fixture(scope="module")
def first(fly):
    return fly("first")


def tlog(flown):
    return (flown.folder / "flight.tlog").read_bytes()


def setpoints(flown):
    return b"".join(
        frame.raw
        for record in read_tlog(flown.folder / "flight.tlog")
        if record.sent
        for frame in Framer().feed(record.raw)
        if frame.message_id == MessageId.SET_ATTITUDE_TARGET
    )


def test_the_same_seed_gives_the_same_bytes(first, fly):
    again = fly("again")
    assert first.outcome.outcome == "landed"
    assert tlog(first) == tlog(again)
    assert len(tlog(first)) > 500_000


def test_another_seed_gives_other_bytes(first, fly):
    other = fly("other", seed=2)
    assert other.outcome.outcome == "landed"
    assert setpoints(other) != setpoints(first)


def test_no_setpoint_depends_on_the_truth(first, fly):
    """Every truth message is turned into noise on the wire, with the right CRC."""
    rng = np.random.default_rng(0)
    scrambled = 0

    def scramble(packet):
        nonlocal scrambled
        truth = packet.component_id == COMPONENT_TRUTH
        if not truth and packet.message_id != MessageId.HIL_STATE_QUATERNION:
            return packet.raw
        scrambled += 1
        return packet.with_payload(rng.bytes(len(packet.payload)))

    blind = fly("blind", from_shim=scramble)
    assert scrambled > 1000
    assert blind.outcome.outcome == "landed"
    assert setpoints(blind) == setpoints(first)
    assert tlog(blind) != tlog(first)  # the recorder did see the difference
