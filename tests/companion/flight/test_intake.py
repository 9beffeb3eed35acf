"""What passes the intake at once, what waits, and what is dropped when too much comes."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.flight.vehicle.intake import (
    BUDGET_BYTES,
    HELD_BYTES,
    LOOKS,
    MOST_TURNS,
    RESERVE,
    STATE_CHARGE,
    TURN_S,
    Gate,
    Intake,
)
from companion.link.link import LinkCounters
from companion.mavlink.codec import Packer, encode
from companion.mavlink.framing import LARGEST_FRAME, Framer
from companion.mavlink.messages import Outgoing

VEHICLE = (1, 1)
HEARTBEAT, ATTITUDE, ODOMETRY, COMMAND_ACK = 0, 30, 331, 77


def odometry(number):
    return Outgoing(ODOMETRY, number.to_bytes(8, "little") + bytes([1] * 224))


def attitude(number):
    return encode("ATTITUDE", time_boot_ms=number, roll=0, pitch=0, yaw=0, rollspeed=0,
                  pitchspeed=0, yawspeed=1.0)  # fmt: skip


def ack(number):
    return encode("COMMAND_ACK", command=number, result=4)


def beat(number):
    return encode("HEARTBEAT", type=2, autopilot=12, base_mode=1, custom_mode=number,
                  system_status=4, mavlink_version=3)  # fmt: skip


def number_of(frame):
    size = {ODOMETRY: 8, COMMAND_ACK: 2}.get(frame.message_id, 4)
    return int.from_bytes(frame.payload[:size], "little")


class Desk:
    """An intake, and what it was told of."""

    def __init__(self, whole=True):
        self.whole = whole
        self.counters = LinkCounters()
        self.noted = []
        self.packer = Packer(*VEHICLE)
        gate = Gate(
            lambda frames: frames,
            lambda frame, now_s: self.noted.append(frame),
            lambda frame: (frame.system_id, frame.component_id) == VEHICLE,
        )
        self.intake = Intake(Framer(), gate, self.counters)

    def packed(self, *outgoings):
        return b"".join(map(self.packer.pack, outgoings))

    def take(self, data, now_s=0.0):
        return self.intake.take(data, now_s, whole=self.whole)

    def release(self):
        return self.intake.release(self.intake.due_s, whole=self.whole)


def ids(frames):
    return [frame.message_id for frame in frames]


@settings(deadline=None, derandomize=True)
@given(st.lists(st.integers(1, 40), max_size=12), st.booleans())
def test_what_an_autopilot_sends_at_full_rate_passes_at_once_and_in_order(sizes, whole):
    desk = Desk(whole)
    now_s = 0.0
    for size in sizes:
        data = [desk.packed(attitude(i)) for i in range(size)]
        data[size // 2 :] = [desk.packed(odometry(7)), *data[size // 2 :]]

        frames = desk.take(b"".join(data), now_s)

        assert [frame.raw for frame in frames] == data
        assert desk.intake.due_s is None
        now_s += TURN_S
    assert desk.counters == LinkCounters()


def traffic(desk, lasting_s):
    """An autopilot's at full rate, 141 kB/s as it is charged: 170 states and 675 others."""
    states, others = round(170 * lasting_s), round(675 * lasting_s)
    data = [desk.packed(attitude(i)) for i in range(others)]
    for i in range(states):
        data.insert(i * len(data) // states, desk.packed(odometry(i)))
    return data


@pytest.mark.parametrize("pause_s", [0.12, 0.25, 1.0])
def test_what_piled_up_in_a_pause_passes_whole_and_is_no_flood(pause_s):
    desk = Desk()
    now_s = 0.0
    for _ in range(30):
        desk.take(b"".join(traffic(desk, TURN_S)), now_s)
        now_s += pause_s
        data = traffic(desk, pause_s)

        assert [frame.raw for frame in desk.take(b"".join(data), now_s)] == data
        assert desk.intake.flooded_turns == 0
        now_s += TURN_S
    assert desk.counters == LinkCounters()


def test_of_a_longer_pause_the_newest_state_passes_and_it_is_no_flood_either():
    desk = Desk()
    desk.take(desk.packed(attitude(0)))
    data = traffic(desk, 2.0)

    frames = desk.take(b"".join(data), 2.0)

    assert [number_of(f) for f in frames if f.message_id == ODOMETRY][-1] == 339
    assert desk.counters.excess_packets == len(data) - len(frames) > 0
    for turn in range(1, 30):
        desk.take(desk.packed(odometry(340 + turn)), 2.0 + turn * TURN_S)
        assert desk.intake.flooded_turns == 0


def test_a_pause_in_a_flood_lets_no_more_of_it_pass_than_a_turn_does():
    desk = Desk()
    flood = desk.packed(attitude(1)) * 1500
    first = desk.take(flood, 0.0)
    assert len(first) == BUDGET_BYTES // 80

    for turn in range(1, 30):
        assert len(desk.take(flood, turn * 2 * TURN_S)) == len(first)
        assert desk.intake.flooded_turns == turn

    desk.take(b"", 60 * TURN_S)
    assert desk.take(flood, 100 * TURN_S) != []
    assert desk.intake.flooded_turns == 0
    assert desk.intake._spent <= MOST_TURNS * BUDGET_BYTES


def test_of_a_flood_in_one_piece_the_newest_state_is_dealt_with_at_once():
    desk = Desk()
    flood = [desk.packed(odometry(i)) for i in range(300)]

    frames = desk.take(b"".join(flood))

    assert [number_of(frame) for frame in frames] == [299]
    assert desk.counters.excess_packets == 299
    assert desk.counters.excess_bytes == 0
    assert len(desk.noted) == 300, "what is dropped is no loss of the link"


def test_of_a_flood_in_many_pieces_the_newest_state_waits_for_the_turns_end():
    desk = Desk()
    dealt_with = []
    for i in range(1000):
        dealt_with += desk.take(desk.packed(odometry(i)), 0.001)

    at_once = BUDGET_BYTES // STATE_CHARGE + RESERVE
    assert [number_of(frame) for frame in dealt_with] == list(range(at_once))
    assert desk.intake.due_s == 0.001 + TURN_S
    assert [number_of(frame) for frame in desk.release()] == [999]
    assert desk.intake.due_s is None
    assert desk.counters.excess_packets == 1000 - at_once - 1


def test_a_babbler_drops_nothing_that_the_flight_rests_on():
    """20,000 packets of no use per second, and everything of the vehicle's that counts."""
    desk = Desk()
    passed = []
    sent = 0
    for turn in range(50):
        now_s = turn * TURN_S
        for i in range(400):
            passed += desk.take(desk.packed(attitude(i)), now_s)
            if i % 100 == 99:
                sent += 1
                passed += desk.take(desk.packed(odometry(sent), beat(sent), ack(sent)), now_s)
    for message_id in (ODOMETRY, HEARTBEAT, COMMAND_ACK):
        numbers = [number_of(frame) for frame in passed if frame.message_id == message_id]
        assert numbers == list(range(1, sent + 1)), "each, at once, in order"
    assert ids(passed).count(ATTITUDE) < 50 * BUDGET_BYTES / 80
    assert desk.counters.excess_packets + ids(passed).count(ATTITUDE) == 50 * 400


def test_others_have_no_share_in_what_is_kept_for_the_vehicle():
    desk = Desk()
    stranger = Packer(2, 1)
    frames = []
    for i in range(1000):
        frames += desk.take(stranger.pack(ack(i)))
    assert len(frames) == BUDGET_BYTES // 80
    assert desk.intake.due_s is None


def test_what_holds_no_packets_takes_a_bounded_time_too():
    for garbage in (b"\xfe", b"\xfd\x00\x00", b"\xfd\xff\x00", b"\xfe\x01", b"\xfd\x00\x01"):
        desk = Desk(whole=False)
        framer = desk.intake._framer
        data = (garbage * 65_536)[:65_536]
        for _ in range(40):
            desk.take(data)

        assert framer.looks < LOOKS + 2 * 2048 + LARGEST_FRAME
        assert desk.intake.held_bytes <= HELD_BYTES
        assert framer.pending_bytes <= LARGEST_FRAME
        assert desk.counters.excess_bytes > 30 * 65_536


def test_after_more_bytes_than_can_be_looked_at_the_newest_state_is_found_at_the_turns_end():
    for whole in (False, True):
        desk = Desk(whole)
        desk.take(b"\xfe" * 65_536)
        frames = desk.take(desk.packed(attitude(1)) * 1000 + desk.packed(odometry(5)))
        assert frames == []

        assert number_of(desk.release()[-1]) == 5
        assert desk.take(desk.packed(odometry(6)), 1.0)[0].message_id == ODOMETRY


def test_the_turn_of_a_simulation_in_fast_motion_holds_as_much_more():
    desk = Desk()
    desk.intake.pace = 5.0
    frames = []
    for i in range(5 * BUDGET_BYTES // 80):
        frames += desk.take(desk.packed(attitude(i)))
    assert len(frames) == 5 * BUDGET_BYTES // 80
    assert desk.counters.excess_packets == 0


@settings(deadline=None, derandomize=True, max_examples=60)
@given(st.integers(0, 2**32), st.booleans())
def test_whatever_comes_nothing_grows_and_everything_is_counted(seed, whole):
    rng = random.Random(seed)
    desk = Desk(whole)
    make = (attitude, odometry, ack, beat)
    now_s, came = 0.0, 0
    dealt_with = []
    for number in range(60):
        count = rng.choice((1, 3, 60, 200))
        outgoings = [rng.choice(make)(number) for _ in range(count)]
        came += count
        dealt_with += desk.take(desk.packed(*outgoings), now_s)
        now_s += rng.choice((0.0, 0.0, 0.001, 0.03))
        assert desk.intake.held_bytes <= HELD_BYTES + 8 * LARGEST_FRAME
    while desk.intake.due_s is not None:
        dealt_with += desk.release()
    if desk.counters.excess_bytes == 0:
        assert len(dealt_with) + desk.counters.excess_packets == came
    for message_id in (ODOMETRY, HEARTBEAT):
        numbers = [number_of(frame) for frame in dealt_with if frame.message_id == message_id]
        assert numbers == sorted(numbers), "no older state after a newer one"
