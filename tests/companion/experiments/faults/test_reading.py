"""When a fault began, and how far the vehicle truly was from its reference."""

import numpy as np
import pytest

from companion.experiments.faults.reading import _moment_s, _sample_times_s

TIMES_S = [20.0 + 0.01 * k for k in range(300)]


def moment(stamps_s, arrival_s, stamp_s):
    return _moment_s(TIMES_S, stamps_s, arrival_s, stamp_s)


def test_an_event_happened_just_before_its_stamp_however_late_it_is_told():
    stamps = [time - 15.0 for time in TIMES_S]
    assert moment(stamps, 22.5, 6.004) == pytest.approx(21.0)
    assert moment(stamps, 21.01, 6.004) == pytest.approx(21.0)


@pytest.mark.parametrize("jump_s", [5.0, -2.0, -6.0])
def test_a_clocks_jump_happened_when_the_stamps_jumped(jump_s):
    stamps = [time - 15.0 + (jump_s if time > 20.995 else 0.0) for time in TIMES_S]
    assert moment(stamps, 21.2, 5.999 + jump_s) == pytest.approx(20.99)


def test_what_has_no_sample_near_it_happened_when_it_was_told():
    stamps = [time - 15.0 for time in TIMES_S]
    assert moment(stamps, 22.0, -100.0) == 22.0
    assert _moment_s([], [], 22.0, 7.0) == 22.0


def test_a_sample_was_true_when_the_truth_had_its_stamp_whenever_it_arrived():
    stamps = [time - 15.0 for time in TIMES_S]
    received = np.array([21.0, 21.5, 22.0])
    ages = np.array([0.0, 0.05, 0.3])
    at = _sample_times_s(received, received - ages - 15.0, np.array(TIMES_S), stamps)
    assert at == pytest.approx(received - ages)


def test_a_stamp_that_cannot_be_is_not_believed():
    stamps = [time - 15.0 for time in TIMES_S]
    received = np.array([21.0, 22.0])
    at = _sample_times_s(received, np.array([30.0, np.nan]), np.array(TIMES_S), stamps)
    assert at == pytest.approx(received)
