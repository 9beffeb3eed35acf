import pytest

from sitl_shim.mavlink.timesync import Timesync


def answers(clock, count, offset_us=5e6, round_trip_us=4000, start_us=1_000_000, rate=1.0):
    for k in range(count):
        sent = start_us + 100_000 * k
        now = sent + round_trip_us
        clock.answer(sent, rate * (0.5 * (sent + now)) - offset_us, now)
    return sent


def test_until_500_answers_a_stamp_means_now():
    clock = Timesync()
    answers(clock, 499)
    assert not clock.converged
    assert clock.boot_time_us(123.0, 777) == 777.0
    answers(clock, 1)
    assert clock.converged
    assert clock.boot_time_us(1000.0, 777) == pytest.approx(5_001_000.0, abs=50.0)


def test_slow_answers_are_no_answers():
    clock = Timesync()
    answers(clock, 600, round_trip_us=12_000)
    assert not clock.converged


def test_a_drifting_clock_is_followed():
    clock = Timesync()
    last = answers(clock, 1500, rate=1.00005)
    stamp = 1.00005 * last - 5e6
    assert clock.boot_time_us(stamp, 0) == pytest.approx(last, abs=1000.0)


def test_a_clock_that_was_set_is_learnt_anew():
    clock = Timesync()
    answers(clock, 600)
    answers(clock, 5, offset_us=9e6, start_us=70_000_000)
    assert clock.converged
    answers(clock, 2, offset_us=9e6, start_us=71_000_000)
    assert not clock.converged
    answers(clock, 600, offset_us=9e6, start_us=72_000_000)
    assert clock.boot_time_us(0.0, 0) == pytest.approx(9e6, abs=100.0)
