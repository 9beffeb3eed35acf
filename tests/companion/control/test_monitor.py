"""The in-flight monitor: what it sees, when it leads down, and that it never chatters."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.control import desired_slew, monitor
from companion.control.desired_slew import DesiredSlew
from companion.control.interfaces import InnerRecord
from companion.control.monitor import Gauges, MonitorLimits, MonitorMemory, Seen
from companion.control.thrust import GRAVITY_M_S2

LIMITS = MonitorLimits(delay_made_for_s=0.03)
STEP_S = 0.01
LOWEST = 2
NOT_KNOWN = np.full(3, np.nan)


def seen_at(time_s, *, y_tilde=0.0, sigma=0.0, roll=0.0, delay_s=0.03, desired=0.0, known=True):
    """A tick with ỹ and σ̂ of one axis as shares of their bounds."""
    inner = InnerRecord(
        np.zeros(3),
        np.zeros(3),
        np.array([0.0, 0.2 * y_tilde, 0.0]) if known else NOT_KNOWN,
        np.array([8.0 * sigma, 0.0, 0.0]) if known else NOT_KNOWN,
        y_tilde_bound_m_s=np.full(3, 0.2) if known else NOT_KNOWN,
        sigma_bound=np.full(3, 8.0) if known else NOT_KNOWN,
    )
    return Seen(time_s, inner, roll, 0.0, delay_s, desired)


def watch(ticks, *, limits=LIMITS, memory=None, lowest=LOWEST, begin_s=0.0):
    """Verdicts of ticks given as keyword arguments, and the memory after them."""
    memory = memory or MonitorMemory()
    verdicts = []
    for k, tick in enumerate(ticks):
        memory, verdict = monitor.step(
            limits, memory, seen_at(begin_s + k * STEP_S, **tick), lowest
        )
        verdicts.append(verdict)
    return verdicts, memory


def levels(verdicts):
    return [verdict.level for verdict in verdicts]


def shaking(amplitude_rad, rate_rad_s, seconds):
    """Ticks whose commanded roll swings."""
    return [
        {"roll": amplitude_rad * math.sin(rate_rad_s * k * STEP_S)}
        for k in range(round(seconds / STEP_S))
    ]


def test_each_gauge_is_one_at_its_bound():
    ticks = [{"y_tilde": 1.0, "sigma": 0.95, "delay_s": 0.08}] * 400
    limits = MonitorLimits(delay_made_for_s=0.03, alarm_after_s=1e3)
    verdicts, _ = watch(ticks, limits=limits)
    gauges = verdicts[-1].gauges
    assert gauges.y_tilde == pytest.approx(1.0, abs=0.01)
    assert gauges.sigma == pytest.approx(1.0, abs=0.01)
    assert gauges.delay == pytest.approx(1.0)
    assert gauges.slew == 0.0


def test_the_slew_of_a_swinging_command_is_its_rms_rate():
    verdicts, _ = watch(shaking(0.2, 3.0, 6.0), limits=MonitorLimits(alarm_after_s=1e3))
    late = [v.gauges.slew for v in verdicts[300:]]
    assert np.sqrt(np.mean(np.square(late))) == pytest.approx(0.2 * 3.0 / math.sqrt(2), rel=0.05)


def test_noise_of_single_samples_is_no_slew():
    rng = np.random.default_rng(1)
    rolls = rng.normal(0.0, math.radians(0.3), 600)
    verdicts, _ = watch([{"roll": float(roll)} for roll in rolls])
    # The rate from sample to sample is 0.7 rad/s rms.
    assert max(v.gauges.slew for v in verdicts) < 0.3


def test_what_the_trajectory_asks_for_is_allowed():
    assert levels(watch(shaking(0.5, 5.0, 3.0))[0])[-1] > 0
    allowed = [tick | {"desired": 2.5} for tick in shaking(0.5, 5.0, 3.0)]
    assert set(levels(watch(allowed)[0])) == {0}


def test_a_gauge_without_a_bound_or_without_a_value_never_speaks():
    verdicts, _ = watch([{"known": False, "delay_s": 5.0}] * 300, limits=MonitorLimits())
    assert all(v.level == 0 and not v.alarm for v in verdicts)
    assert math.isnan(verdicts[-1].gauges.y_tilde)
    assert math.isnan(verdicts[-1].gauges.sigma)
    assert math.isnan(verdicts[-1].gauges.delay)


def test_above_its_bound_it_leads_down_within_half_a_second_and_says_why():
    verdicts, _ = watch([{}] * 100 + [{"y_tilde": 1.4}] * 100)
    first = levels(verdicts).index(1)
    assert (first - 100) * STEP_S < 0.6
    assert verdicts[first].reasons[0].startswith("ỹ 1.")


def test_far_above_it_leads_straight_to_the_last_level():
    verdicts, _ = watch([{}] * 10 + [{"delay_s": 0.2}] * 200)
    assert 1 not in levels(verdicts) or levels(verdicts).count(1) < 50
    verdicts, _ = watch([{"delay_s": 0.2}] * 40)
    assert levels(verdicts)[-1] == LOWEST
    assert 1 not in levels(verdicts)


def test_a_short_excess_is_passed_over():
    verdicts, _ = watch([{}] * 50 + [{"y_tilde": 3.0}] * 3 + [{}] * 100)
    assert set(levels(verdicts)) == {0}


def test_with_a_single_level_it_warns_and_leads_nowhere():
    verdicts, _ = watch([{"y_tilde": 2.0}] * 300, lowest=0)
    assert set(levels(verdicts)) == {0}
    assert verdicts[-1].alarm
    assert verdicts[-1].reasons


def test_the_way_up_needs_a_long_calm():
    _, memory = watch([{"y_tilde": 1.3}] * 80)
    assert memory.level == 1
    verdicts, memory = watch([{}] * 490, memory=memory, begin_s=1.0)
    assert set(levels(verdicts)) == {1}
    verdicts, memory = watch([{}] * 60, memory=memory, begin_s=5.9)
    assert levels(verdicts)[-1] == 0
    assert memory.ascents == 1


def test_between_calm_and_the_bound_nothing_changes():
    _, memory = watch([{"y_tilde": 1.3}] * 80)
    assert memory.level == 1
    verdicts, _ = watch([{"y_tilde": 0.9}] * 3000, memory=memory, begin_s=1.0)
    assert set(levels(verdicts)) == {1}


def test_an_ascent_that_failed_is_the_last():
    ill, well = [{"y_tilde": 1.4}] * 75, [{}] * 700
    _, memory = watch(ill)
    _, memory = watch(well, memory=memory, begin_s=1.0)
    assert memory.level == 0
    _, memory = watch(ill, memory=memory, begin_s=8.0)
    assert memory.level == LOWEST
    verdicts, _ = watch([{}] * 6000, memory=memory, begin_s=9.0)
    assert set(levels(verdicts)) == {LOWEST}


def test_after_a_change_the_gauges_begin_anew():
    _, memory = watch([{"y_tilde": 1.4, "sigma": 0.9}] * 60)
    assert memory.level == 1
    after, _ = monitor.step(LIMITS, monitor.at_level(memory, 1), seen_at(0.6), LOWEST)
    assert after.smoothed.sigma == 0.0
    assert after.smoothed.y_tilde_square == 0.0


def test_the_larger_of_two_gauges_wins_and_what_is_known():
    nan = math.nan
    larger = Gauges(nan, 0.5, 2.0, nan).largest(Gauges(0.1, nan, 1.0, nan))
    assert larger[:3] == (0.1, 0.5, 2.0)
    assert math.isnan(larger.delay)


@settings(deadline=None, derandomize=True, max_examples=60)
@given(
    st.lists(
        st.tuples(st.floats(0.0, 4.0), st.floats(0.1, 12.0)),  # what is seen, and for how long
        min_size=1,
        max_size=12,
    )
)
def test_whatever_happens_it_goes_up_twice_at_most_and_never_soon_after_a_change(parts):
    memory, time_s, level, changed_s, ups = MonitorMemory(), 0.0, 0, -math.inf, 0
    for y_tilde, seconds in parts:
        for _ in range(max(1, round(seconds / 0.05))):
            time_s += 0.05
            memory, verdict = monitor.step(LIMITS, memory, seen_at(time_s, y_tilde=y_tilde), LOWEST)
            if verdict.level < level:
                ups += 1
                assert verdict.level == level - 1
                assert time_s - changed_s >= LIMITS.ascend_after_s - 1e-6
            elif verdict.level > level:
                assert time_s - changed_s >= LIMITS.alarm_after_s - 1e-6
            if verdict.level != level:
                level, changed_s = verdict.level, time_s
            assert memory.level == level
    assert ups <= LIMITS.ascents


def test_a_circles_slew_is_its_jerk_over_g_and_is_kept_for_a_while():
    def circle(times):
        return np.stack([np.cos(1.5 * times), np.sin(1.5 * times), 0.0 * times], axis=1)

    def rest(times):
        return np.zeros((len(times), 3))

    memory = DesiredSlew()
    for k in range(100):
        memory = desired_slew.step(memory, circle, k * STEP_S)
    assert memory.rate_rad_s == pytest.approx(1.5**3 / GRAVITY_M_S2, rel=0.02)
    kept = [memory := desired_slew.step(memory, rest, 1.0 + k * STEP_S) for k in range(600)]
    assert kept[90].rate_rad_s == pytest.approx(1.5**3 / GRAVITY_M_S2, rel=0.02)
    assert kept[-1].rate_rad_s < 0.01


def test_a_reference_that_jumps_asks_for_no_more_than_can_be_flown():
    def jump(times):
        return np.where(times[:, None] > 0.5, 1e3, 0.0) * np.ones(3)

    memory = DesiredSlew()
    for k in range(100):
        memory = desired_slew.step(memory, jump, k * STEP_S)
    assert 1.0 < memory.rate_rad_s <= 5.0
