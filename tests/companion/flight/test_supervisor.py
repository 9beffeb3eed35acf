"""The ladder: what it decides, and laws that hold whatever happens."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.flight.setpoints.supervisor import (
    RESTARTING,
    Facts,
    Rung,
    SupervisorLimits,
    SupervisorMemory,
    judge,
)

LIMITS = SupervisorLimits(state_age_limit_s=0.1, hand_over_after_s=0.8, failed_solves_s=1.0)
STEP_S = 0.01

ticks = st.lists(
    st.tuples(
        st.floats(-0.01, 0.3),
        st.floats(0.0, 0.5),
        st.sampled_from(["", "broken", RESTARTING]),
        st.booleans(),
    ),
    max_size=80,
)


def run(facts, memory=None):
    memory = memory or SupervisorMemory()
    for fact in facts:
        memory = judge(LIMITS, memory, fact)
        yield fact, memory


def every_10_ms(duration_s, start_s=0.0, **facts):
    usual = {"state_age_s": 0.0, "problem": "", "plan_solved": True}
    count = round(duration_s / STEP_S)
    return [Facts(start_s + k * STEP_S, **(usual | facts)) for k in range(count)]


def facts_of(ticks):
    now = 5.0
    for passed, age, problem, solved in ticks:
        now += passed
        yield Facts(now, age, problem, solved)


@settings(deadline=None, derandomize=True)
@given(ticks)
def test_nothing_climbs_up_from_a_hand_over(ticks):
    handed_over = None
    for _, memory in run(facts_of(ticks)):
        if handed_over is not None:
            assert memory == handed_over
        if memory.rung is Rung.HAND_OVER:
            handed_over = memory


@settings(deadline=None, derandomize=True)
@given(ticks)
def test_tracking_needs_a_fresh_state_and_a_command_that_is_well(ticks):
    for facts, memory in run(facts_of(ticks)):
        if memory.rung is Rung.TRACK:
            assert facts.state_age_s <= LIMITS.state_age_limit_s
            assert not facts.problem
            assert memory.reason == ""
        else:
            assert memory.rung is Rung.HAND_OVER or facts.problem or facts.state_age_s > 0.1


@settings(deadline=None, derandomize=True)
@given(ticks)
def test_level_never_lasts_longer_than_allowed(ticks):
    level_since = None
    for facts, memory in run(facts_of(ticks)):
        if memory.rung is not Rung.LEVEL:
            level_since = None
            continue
        level_since = memory.judged_s if level_since is None else level_since
        assert memory.judged_s - level_since <= LIMITS.hand_over_after_s + 1e-9
        assert facts.problem or facts.state_age_s > 0.1


@pytest.mark.parametrize(
    "bad", [{"state_age_s": 0.2}, {"problem": "broken"}, {"state_age_s": 0.2, "problem": "NaN"}]
)
def test_level_becomes_a_hand_over_after_its_time(bad):
    times = {}
    for facts, memory in run(every_10_ms(2.0, **bad)):
        times.setdefault(memory.rung, facts.now_s)
    assert Rung.TRACK not in times
    assert times[Rung.LEVEL] == 0.0
    assert times[Rung.HAND_OVER] == pytest.approx(0.81, abs=1e-6)


def test_failed_plans_become_a_hand_over_after_their_time():
    times = {}
    for facts, memory in run(every_10_ms(2.0, plan_solved=False)):
        times.setdefault(memory.rung, (facts.now_s, memory.reason))
    assert Rung.LEVEL not in times
    when, why = times[Rung.HAND_OVER]
    assert when == pytest.approx(1.01, abs=1e-6)
    assert why == "no plan could be solved for 1 s"


def test_one_solved_plan_ends_the_count():
    facts = every_10_ms(0.9, plan_solved=False)
    facts += every_10_ms(0.01, 0.9)
    facts += every_10_ms(0.9, 0.91, plan_solved=False)
    assert {memory.rung for _, memory in run(facts)} == {Rung.TRACK}


def test_a_short_fault_is_forgotten():
    facts = every_10_ms(0.6, problem="broken")
    facts += every_10_ms(3.0, 0.6)
    facts += every_10_ms(0.6, 3.6, problem="broken")
    assert Rung.HAND_OVER not in {memory.rung for _, memory in run(facts)}


def test_a_fault_that_comes_and_goes_is_not_forgotten():
    facts = []
    for k in range(20):
        facts += every_10_ms(0.1, 0.2 * k, problem="broken")
        facts += every_10_ms(0.1, 0.2 * k + 0.1)
    ends = [facts.now_s for facts, memory in run(facts) if memory.rung is Rung.HAND_OVER]
    # Each 0.2 s bring 0.1 s of level less a quarter of 0.1 s.
    assert ends[0] == pytest.approx(0.8 / 0.075 * 0.2, abs=0.4)


def test_while_the_controller_starts_again_the_first_reason_stands():
    facts = [
        Facts(0.0, 0.2, "", True),
        Facts(0.01, 0.0, RESTARTING, True),
        Facts(0.02, 0.0, "", True),
    ]
    reasons = [(memory.rung, memory.reason) for _, memory in run(facts)]
    assert reasons[0] == (Rung.LEVEL, "no usable state for more than 100 ms")
    assert reasons[1] == reasons[0]
    assert reasons[2] == (Rung.TRACK, "")


def test_what_was_wrong_with_the_samples_is_part_of_the_reason():
    memory = judge(LIMITS, SupervisorMemory(), Facts(0.0, 0.2, "it is all NaN", True))
    assert memory.reason == "no usable state for more than 100 ms (it is all NaN)"


def test_a_clock_that_steps_back_a_little_does_no_harm():
    memory = judge(LIMITS, SupervisorMemory(), Facts(1.0, 0.2, "", True))
    memory = judge(LIMITS, memory, Facts(0.99, 0.2, "", True))
    assert memory.level_s == 0.0
    assert memory.judged_s == 1.0


DELAY_LIMITS = replace(LIMITS, loop_delay_limit_s=0.1)


def slow_loop(delays_s, memory=None):
    """Judge ticks of a loop whose delay is measured at each."""
    memory = memory or SupervisorMemory()
    for k, delay_s in enumerate(delays_s):
        facts = Facts(k * STEP_S, 0.0, "", True, delay_s)
        memory = judge(DELAY_LIMITS, memory, facts)
        yield memory


def test_a_loop_that_stays_too_slow_is_levelled_and_then_handed_over():
    found = list(slow_loop([0.03] * 100 + [0.2] * 200))
    level = next(k for k, memory in enumerate(found) if memory.rung is Rung.LEVEL)
    over = next(k for k, memory in enumerate(found) if memory.rung is Rung.HAND_OVER)
    assert 0.05 < (level - 100) * STEP_S < 0.3
    assert over - level == pytest.approx(80, abs=2)
    assert "more than 100 ms" in found[level].reason
    assert "the link is too slow, or this computer" in found[level].reason  # nobody here knows
    assert found[over].reason == found[level].reason + ", for 0.8 s"


def test_samples_that_come_late_now_and_then_make_no_slow_loop():
    delays_s = [0.06 if k % 10 else 0.25 for k in range(500)]
    assert {memory.rung for memory in slow_loop(delays_s)} == {Rung.TRACK}


def test_a_loop_about_its_limit_does_not_flutter():
    delays_s = [0.2] * 50 + [0.105, 0.085] * 100
    rungs = [memory.rung for memory in slow_loop(delays_s)]
    assert Rung.TRACK not in rungs[50:]


def test_a_loop_that_is_fast_again_is_tracked_on():
    found = list(slow_loop([0.03] * 50 + [0.2] * 40 + [0.03] * 100))
    assert found[-1].rung is Rung.TRACK
    assert found[-1].reason == ""


def test_a_state_that_is_stale_for_long_is_handed_over_by_its_age_whatever_the_clock_says():
    """The autopilot's clock was set back: to the ladder no time passes."""
    memory = SupervisorMemory(judged_s=100.0)
    for k in range(100):
        memory = judge(LIMITS, memory, Facts(98.0, k * STEP_S, "", True))
    assert memory.rung is Rung.HAND_OVER
