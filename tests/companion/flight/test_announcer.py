"""What is told of the ladder: every change for the worse at once, and never a flood."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.flight.setpoints.announcer import QUIET_S, SETTLED_S, WELL, Announcer, Condition
from companion.flight.setpoints.supervisor import Rung

SHIFTED = Condition(Rung.TRACK, "shifted plan", "")
CLIPPED = Condition(Rung.TRACK, "clipped closed form", "")
LEVEL = Condition(Rung.LEVEL, "level", "no state")
OVER = Condition(Rung.HAND_OVER, "hand over", "no state, for 0.8 s")


def told(sequence, step_s=0.01):
    announcer = Announcer()
    return [(k * step_s, c) for k, c in enumerate(sequence) if announcer.due(c, k * step_s)]


def test_well_from_the_start_is_not_told():
    assert told([WELL] * 500) == []


def test_each_rung_down_is_told_at_once():
    assert told([WELL, SHIFTED, LEVEL, OVER]) == [(0.01, SHIFTED), (0.02, LEVEL), (0.03, OVER)]


def test_a_fallback_that_flickers_is_told_once():
    assert told([SHIFTED, WELL] * 1000) == [(0.0, SHIFTED)]


def test_a_fallback_that_comes_back_now_and_then_is_told_once_in_the_quiet_time():
    lapses = ([SHIFTED] * 5 + [WELL] * 115) * 20
    times = [t for t, c in told(lapses) if c == SHIFTED]
    assert len(times) >= 5
    assert all(b - a >= QUIET_S for a, b in pairwise(times))


def test_recovery_is_told_when_it_has_lasted():
    sequence = [SHIFTED] + [WELL] * 300
    (_, first), (when, second) = told(sequence)
    assert (first, second) == (SHIFTED, WELL)
    assert when == pytest.approx(SETTLED_S + 0.01)


def test_the_next_fallback_down_is_told_at_once():
    assert told([SHIFTED] * 30 + [CLIPPED] * 300) == [(0.0, SHIFTED), (0.3, CLIPPED)]


def test_a_flicker_does_not_hide_what_is_worse():
    sequence = [SHIFTED, WELL] * 50 + [LEVEL, SHIFTED] * 20 + [OVER]
    assert LEVEL in [c for _, c in told(sequence)]
    when, last = told(sequence)[-1]
    assert last == OVER
    assert when == pytest.approx(len(sequence) * 0.01 - 0.01)


@settings(deadline=None, derandomize=True)
@given(st.lists(st.sampled_from([WELL, SHIFTED, CLIPPED, LEVEL]), max_size=600))
def test_there_are_never_more_than_a_few_messages_in_the_quiet_time(sequence):
    times = [t for t, _ in told(sequence)]
    for begin in times:
        assert len([t for t in times if begin <= t < begin + QUIET_S]) <= 5


@settings(deadline=None, derandomize=True)
@given(st.lists(st.sampled_from([WELL, SHIFTED, LEVEL]), max_size=200))
def test_what_lasts_is_told_in_the_end(sequence):
    for last in (WELL, SHIFTED, LEVEL):
        heard = told([*sequence, *[last] * 450])
        assert (heard[-1][1] if heard else WELL) == last


def test_a_hand_over_names_what_the_vehicle_does():
    text = OVER.text("the stream stops")
    assert text == "handing over: no state, for 0.8 s; the stream stops"
    assert OVER.severity == "error"


def remarks_told(remarks, step_s=0.01):
    announcer = Announcer()
    return [(k * step_s, r) for k, r in enumerate(remarks) if announcer.due_remark(r, k * step_s)]


def test_remarks_that_differ_in_their_numbers_alone_are_told_once_in_the_quiet_time():
    times = [t for t, _ in remarks_told([f"it turned by {k % 7}.{k} m" for k in range(1000)])]
    assert times == pytest.approx([0.0, 2.0, 4.0, 6.0, 8.0], abs=0.011)


def test_another_remark_is_told_at_once():
    assert remarks_told(["a 1", "b 1", "a 2"]) == [(0.0, "a 1"), (0.01, "b 1")]
