import itertools
import math
import random
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.mavlink.codec import Packer
from companion.mavlink.framing import Framer
from companion.mavlink.messages import Outgoing
from companion.mavlink.timesync import ClockEstimator


def timesync(tc1_ns, ts1_ns):
    (frame,) = Framer().feed(Packer(1, 1).pack(Outgoing(111, struct.pack("<qq", tc1_ns, ts1_ns))))
    return frame


def asked(outgoing):
    """The (tc1, ts1) of a request."""
    ((message_id, payload),) = outgoing
    assert message_id == 111
    return struct.unpack("<qq", payload)


def exchange(clock, now_s, *, autopilot, there_s=0.002, back_s=0.002):
    """One question and its answer; gives the time at which the answer came."""
    _, ts1 = asked(clock.outgoing(now_s))
    answer_ns = round(autopilot(now_s + there_s) * 1e9)
    clock.on_timesync(now_s + there_s + back_s, timesync(answer_ns, ts1))
    return now_s + there_s + back_s


@settings(deadline=None, derandomize=True)
@given(st.floats(0.9, 20.0), st.floats(0.0, 5000.0), st.integers(0, 1000))
def test_the_autopilots_time_is_found_at_any_rate_under_jitter(rate, start_s, seed):
    clock, jitter = ClockEstimator(), random.Random(seed)

    def autopilot(now_s):
        return start_s + rate * (now_s - 100.0)

    now_s = 100.0
    for _ in range(30):
        now_s = max(now_s, clock.due_s)
        now_s = exchange(
            clock,
            now_s,
            autopilot=autopilot,
            there_s=0.001 + jitter.expovariate(1000.0),
            back_s=0.001 + jitter.expovariate(1000.0),
        )

    assert clock.valid
    assert clock.rate == pytest.approx(rate, rel=2e-3)
    for ahead_s in (0.0, 0.25, 0.5):
        error_s = clock.autopilot_time(now_s + ahead_s) - autopilot(now_s + ahead_s)
        assert abs(error_s) < 1.5e-3 * rate


def test_a_constant_delay_gives_the_exact_line_and_the_round_trip():
    clock = ClockEstimator()
    now_s = 50.0
    for _ in range(5):
        now_s = max(now_s, clock.due_s)
        now_s = exchange(clock, now_s, autopilot=lambda t: t - 47.0, there_s=0.015, back_s=0.015)

    assert clock.round_trip_s == pytest.approx(0.030, abs=1e-6)
    assert clock.autopilot_time(60.0) == pytest.approx(13.0, abs=1e-5)


def test_late_answers_hardly_weigh():
    clock = ClockEstimator()
    now_s = 0.0
    for step in range(20):
        now_s = max(now_s, clock.due_s)
        back_s = 0.2 if step % 4 == 3 else 0.002
        now_s = exchange(clock, now_s, autopilot=lambda t: t + 3.0, back_s=back_s)

    assert clock.autopilot_time(now_s) == pytest.approx(now_s + 3.0, abs=1e-3)


def test_nothing_is_valid_before_enough_exchanges():
    clock = ClockEstimator()
    assert not clock.valid
    assert math.isnan(clock.round_trip_s)

    exchange(clock, 0.0, autopilot=lambda t: t + 3.0)

    assert not clock.valid


def test_questions_come_quickly_first_and_then_four_times_a_second():
    clock = ClockEstimator()
    times = []
    now_s = 0.0
    while len(times) < 15:
        if clock.outgoing(now_s):
            times.append(now_s)
        now_s = clock.due_s

    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert gaps[:9] == pytest.approx([0.1] * 9)
    assert gaps[9:] == pytest.approx([0.25] * 5)


def test_the_autopilots_own_question_is_answered_with_our_time():
    clock = ClockEstimator()

    tc1, ts1 = asked(clock.on_timesync(12.5, timesync(0, 987_654_321)))

    assert (tc1, ts1) == (12_500_000_000, 987_654_321)
    assert asked(clock.on_timesync(0.0, timesync(0, 5)))[0] > 0, "0 would be a question"
    assert not clock.valid


def test_answers_to_others_and_repeated_answers_are_not_taken():
    clock = ClockEstimator()
    _, ts1 = asked(clock.outgoing(1.0))
    clock.on_timesync(1.01, timesync(5_000_000_000, ts1 + 1))
    assert math.isnan(clock.round_trip_s)

    clock.on_timesync(1.01, timesync(5_000_000_000, ts1))
    clock.on_timesync(1.90, timesync(5_000_000_000, ts1))

    assert clock.round_trip_s == pytest.approx(0.01)


def test_one_wild_answer_is_ignored_and_a_restart_is_believed():
    clock = ClockEstimator()
    now_s = 0.0
    for _ in range(10):
        now_s = max(now_s, clock.due_s)
        now_s = exchange(clock, now_s, autopilot=lambda t: t + 100.0)
    before_s = clock.autopilot_time(now_s)
    now_s = exchange(clock, max(now_s, clock.due_s), autopilot=lambda t: t + 5000.0)
    assert clock.autopilot_time(now_s) == pytest.approx(now_s + 100.0, abs=1e-3)
    assert before_s > 100.0

    for _ in range(6):
        now_s = exchange(clock, max(now_s, clock.due_s), autopilot=lambda t: t - 1.0)

    assert clock.autopilot_time(now_s) == pytest.approx(now_s - 1.0, abs=1e-3)


@settings(deadline=None, derandomize=True, max_examples=300)
@given(st.integers(0, 100_000), st.sampled_from(["there", "back", "both"]))
def test_jitter_of_80_ms_never_makes_a_valid_clock_run_away(seed, way):
    clock, jitter = ClockEstimator(), random.Random(seed)
    now_s, begun_s, errors = 100.0, 100.0, []

    while now_s < begun_s + 20.0:
        now_s = max(now_s, clock.due_s)
        now_s = exchange(
            clock,
            now_s,
            autopilot=lambda t: t - 90.0,
            there_s=0.001 + (jitter.uniform(0.0, 0.08) if way != "back" else 0.0),
            back_s=0.001 + (jitter.uniform(0.0, 0.08) if way != "there" else 0.0),
        )
        if clock.valid:
            error_s = abs(clock.autopilot_time(now_s + 0.02) - (now_s + 0.02 - 90.0))
            errors.append((now_s - begun_s, error_s, abs(clock.rate - 1.0)))

    # Nothing can tell apart a delay there and one back: 40 ms is what 80 ms of either may cost.
    assert max(error_s for _, error_s, _ in errors) < 0.04
    assert max(rate for _, _, rate in errors) < 0.02
    assert max(rate for since_s, _, rate in errors if since_s > 8.0) < 0.005


@pytest.mark.parametrize("jitter_s", [0.0, 0.02, 0.08])
def test_another_rate_is_found_in_spite_of_jitter(jitter_s):
    clock, jitter = ClockEstimator(), random.Random(1)
    now_s = 0.0
    while now_s < 12.0:
        now_s = max(now_s, clock.due_s)
        back_s = 0.002 + jitter.uniform(0.0, jitter_s)
        now_s = exchange(clock, now_s, autopilot=lambda t: 0.95 * t, back_s=back_s)

    assert clock.rate == pytest.approx(0.95, abs=0.005)
    assert clock.autopilot_time(now_s) == pytest.approx(0.95 * now_s, abs=0.01)


def test_a_short_burst_is_not_valid_yet():
    clock = ClockEstimator()
    now_s, valid = 0.0, []
    for _ in range(8):
        now_s = max(now_s, clock.due_s)
        now_s = exchange(clock, now_s, autopilot=lambda t: t + 3.0)
        valid.append(clock.valid)

    assert valid == [False] * 5 + [True] * 3


@pytest.mark.parametrize(("there_s", "back_s"), [(0.1, 0.015), (0.015, 0.1), (0.08, 0.06)])
def test_a_link_that_becomes_slower_is_noticed_within_a_second_and_which_way_it_is(there_s, back_s):
    clock = ClockEstimator()
    now_s = 0.0
    while now_s < 9.0:
        now_s = max(now_s, clock.due_s)
        ways = (there_s, back_s) if now_s > 5.0 else (0.015, 0.015)
        now_s = exchange(clock, now_s, autopilot=lambda t: t, there_s=ways[0], back_s=ways[1])
        if ways[0] == 0.015 == ways[1]:
            assert clock.way_there_s == pytest.approx(0.015, abs=1e-6)
        elif now_s > 6.5:
            assert clock.way_there_s == pytest.approx(ways[0], abs=5e-3)
            # Whatever the clock's error: there and back are what they are together.
            came_s = now_s
            age_s = clock.autopilot_time(came_s) - (came_s - ways[1])
            assert clock.way_there_s + age_s == pytest.approx(sum(ways), abs=2e-3)


def test_one_short_round_trip_tells_that_it_is_fast_again_and_jitter_is_nothing():
    clock, now_s = ClockEstimator(), 0.0
    assert math.isnan(clock.way_there_s)
    for step in range(40):
        now_s = max(now_s, clock.due_s)
        back_s = 0.002 if step % 3 else 0.018
        now_s = exchange(clock, now_s, autopilot=lambda t: t, back_s=back_s)
    assert clock.way_there_s == 0.5 * clock.round_trip_s


def test_questions_that_nobody_answers_are_known_since_when():
    clock = ClockEstimator()
    assert clock.unanswered_since(0.0) == math.inf
    now_s = exchange(clock, 1.0, autopilot=lambda t: t)
    assert clock.unanswered_since(0.0) == math.inf
    asked_s = []
    while len(asked_s) < 5:
        now_s = max(now_s, clock.due_s)
        asked_s.append(now_s)
        last = asked(clock.outgoing(now_s))[1]
    assert clock.unanswered_since(0.0) == asked_s[0]
    assert clock.unanswered_since(asked_s[2]) == asked_s[2]
    clock.on_timesync(now_s + 0.3, timesync(1, last))
    assert clock.unanswered_since(0.0) == math.inf


def test_an_answer_to_an_early_question_leaves_the_later_ones_open():
    clock = ClockEstimator()
    first = asked(clock.outgoing(0.0))[1]
    clock.outgoing(0.1)
    clock.on_timesync(0.15, timesync(1, first))
    assert clock.unanswered_since(0.0) == 0.1
