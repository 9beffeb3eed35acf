"""What the companion does when the vehicle's state does not come, is old, or is nonsense."""

import math
import struct

import pytest

from companion.mavlink.messages import MessageId
from tests.flights.wire import AUTOPILOT

STATE = (MessageId.ODOMETRY,)
LEVEL_LIMIT_S = 0.1
HAND_OVER_S = 0.8


def is_state(packet):
    return packet.message_id == MessageId.ODOMETRY and packet.component_id == AUTOPILOT


def test_sixty_milliseconds_without_state_are_nothing(bench):
    bench.after("track", 1.0, lambda: bench.wire.cut(0.06, STATE))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.outcome.fallbacks == 0


@pytest.mark.parametrize("gap_s", [0.15, 0.4, 0.7])
def test_a_gap_in_the_state_is_flown_level_and_tracking_comes_back(bench, gap_s):
    bench.after("track", 1.0, lambda: bench.wire.cut(gap_s, STATE))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    cut = flown.began("track") + 1.0
    (level,) = flown.told("level and holding altitude: no usable state for more than 100 ms")
    assert LEVEL_LIMIT_S - 0.01 < level - cut < LEVEL_LIMIT_S + 0.05
    (back,) = flown.told("tracking")
    assert back > cut + gap_s
    level_ticks = [r for r in flown.records("control") if r.values["phase"] == "silence"]
    assert {r.values["rung"] for r in level_ticks} == {"level"}
    # What follows the gap continues the vehicle's motion: no setpoint jumps against its attitude.
    after = [s for s in flown.wire.setpoints if cut + gap_s < s.time_s < cut + gap_s + 0.2]
    assert max(s.tilt_deg for s in after) < 12.0


def test_state_that_never_returns_hands_over_once_and_for_all(bench):
    bench.after("track", 1.0, lambda: bench.wire.cut(None, STATE))
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    assert not flown.outcome.completed
    cut = flown.began("track") + 1.0
    (over,) = flown.told("handing over: no usable state")
    assert over - cut == pytest.approx(LEVEL_LIMIT_S + HAND_OVER_S, abs=0.06)
    assert flown.wire.setpoints_after(over) == []
    # PX4's failsafe then brings the vehicle down; the companion watches and says so.
    assert flown.wire.armed[-1][1] is False
    assert "landed and disarmed" in flown.outcome.note


def test_state_that_comes_back_after_the_hand_over_does_not_resume_the_stream(bench):
    bench.after("track", 1.0, lambda: bench.wire.cut(1.5, STATE))
    flown = bench.fly()
    (over,) = flown.told("handing over: no usable state")
    assert flown.wire.setpoints_after(over) == []
    assert flown.outcome.outcome == "aborted"


@pytest.mark.parametrize("field", ["position", "velocity", "rate", "attitude"])
def test_state_that_is_not_a_number_is_no_state(bench, field):
    offset = {"position": 8, "attitude": 20, "velocity": 36, "rate": 48}[field]

    def spoil(packet):
        if not is_state(packet):
            return packet.raw
        payload = bytearray(packet.payload)
        struct.pack_into("<f", payload, offset, math.nan)
        return packet.with_payload(bytes(payload))

    def begin():
        bench.wire.from_shim = spoil
        bench.wire.restore_after(0.3)

    bench.after("track", 1.0, begin)
    flown = bench.fly(check=False)
    assert flown.outcome.outcome == "landed"
    assert flown.told("level and holding altitude: no usable state for more than 100 ms (ODOMETRY")
    for s in flown.wire.setpoints:
        assert all(math.isfinite(c) for c in (*s.quaternion, s.thrust))


def test_one_spoiled_sample_among_good_ones_changes_nothing(bench):
    count = 0

    def spoil(packet):
        nonlocal count
        if not is_state(packet):
            return packet.raw
        count += 1
        if count % 5:
            return packet.raw
        return packet.with_payload(packet.payload[:8] + b"\xff" * 12 + packet.payload[20:])

    bench.after("track", 1.0, lambda: setattr(bench.wire, "from_shim", spoil))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.fallbacks == 0


def test_state_that_comes_late_is_not_flown_on(bench):
    """The samples keep coming, each 300 ms old."""
    held = []

    def delay(packet):
        if not is_state(packet):
            return packet.raw
        held.append(packet.raw)
        return held.pop(0) if len(held) > 30 else b""

    def begin():
        bench.wire.from_shim = delay

    bench.after("track", 1.0, begin)
    flown = bench.fly(check=False)
    assert flown.outcome.outcome == "aborted"
    begun = flown.began("track") + 1.0
    (over,) = flown.told("handing over: no usable state")
    assert "ms old by the common clock" in flown.outcome.note
    assert over - begun == pytest.approx(LEVEL_LIMIT_S + HAND_OVER_S, abs=0.06)
    assert all(s.tilt_deg < 0.01 for s in flown.wire.setpoints_after(begun + 0.15))


def test_a_state_that_stands_still_in_time_is_no_state(bench):
    """The estimator has died and its last sample is sent again and again."""
    last = []

    def freeze(packet):
        if not is_state(packet):
            return packet.raw
        if not last:
            last.append(packet.raw)
        return last[0]

    bench.after("track", 1.0, lambda: setattr(bench.wire, "from_shim", freeze))
    flown = bench.fly(check=False)
    assert flown.outcome.outcome == "aborted"
    assert flown.told("handing over: no usable state")


def test_a_link_that_falls_silent_is_said_within_two_seconds_and_given_up(bench):
    bench.after("track", 1.0, lambda: bench.wire.cut(None))
    flown = bench.fly()
    cut = flown.began("track") + 1.0
    (said,) = flown.told("nothing was heard from the autopilot")
    assert said - cut < 2.0
    assert flown.outcome.outcome == "aborted"
    assert "the link is lost" in flown.outcome.note
    (over,) = flown.told("handing over")
    assert flown.wire.setpoints_after(over) == []
    last = flown.records("event")[-1]
    assert last.time_s - cut < 6.0
    assert "the link is lost" in last.values["text"]


def test_a_link_that_comes_back_in_time_leaves_the_vehicle_to_the_autopilot(bench):
    bench.after("track", 1.0, lambda: bench.wire.cut(2.5))
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    assert "the autopilot has landed and disarmed" in flown.outcome.note
    (over,) = flown.told("handing over")
    assert flown.wire.setpoints_after(over) == []


def test_dropouts_again_and_again_end_with_the_autopilot(bench):
    """Each alone would be harmless: half of the time there is no state."""

    def flicker(packet):
        return b"" if is_state(packet) and packet.time_s % 0.8 < 0.5 else packet.raw

    bench.after("track", 0.5, lambda: setattr(bench.wire, "from_shim", flicker))
    flown = bench.fly()
    assert flown.outcome.outcome == "aborted"
    (over,) = flown.told("handing over")
    assert over - flown.began("track") < 4.0
    assert len(flown.told("level and holding altitude")) <= 2
