"""A time since boot that falls: a restart, or a clock that was set back."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.mavlink.boot_time import BootWatch, Fall


def watched(until_s, now_s=50.0):
    watch = BootWatch()
    assert watch.fall(until_s, now_s) is None
    return watch


def test_packets_that_are_late_are_no_fall():
    watch = BootWatch()
    times = (100.0, 100.5, 100.4, 101.0, 100.1, 1e6)
    assert [watch.fall(t, 10.0 + k) for k, t in enumerate(times)] == [None] * len(times)
    assert watch.latest_s == 1e6


def test_a_restart_is_a_time_that_falls_to_nearly_nothing():
    watch = watched(100.0)
    assert watch.fall(0.7, 50.9) is Fall.RESTART
    assert watch.fall(1.2, 51.4) is None
    assert watch.fall(math.nan, 52.0) is None
    assert watch.latest_s == 1.2


def test_after_a_long_silence_a_restarted_one_may_have_run_for_as_long():
    assert watched(100.0).fall(29.0, 80.0) is Fall.RESTART
    assert watched(100.0).fall(39.0, 80.0) is Fall.SET_BACK


@pytest.mark.parametrize("by_s", [1.5, 2.0, 60.0])
def test_a_clock_that_is_set_back_is_no_restart(by_s):
    watch = watched(100.0)
    assert watch.fall(100.0 - by_s, 50.1) is Fall.SET_BACK
    assert watch.fall(100.1 - by_s, 50.2) is None


def test_a_fast_clock_has_run_for_longer():
    assert watched(1000.0).fall(90.0, 60.0, rate=10.0) is Fall.RESTART
    assert watched(1000.0).fall(90.0, 60.0, rate=1.0) is Fall.SET_BACK


@settings(deadline=None, derandomize=True)
@given(st.floats(10.0, 1e6), st.floats(0.0, 100.0), st.floats(0.5, 2.0))
def test_a_restart_is_found_however_long_it_took(until_s, silent_s, rate):
    ran_s = rate * silent_s
    if ran_s < until_s - 1.0:
        assert watched(until_s).fall(ran_s, 50.0 + silent_s, rate) is Fall.RESTART
