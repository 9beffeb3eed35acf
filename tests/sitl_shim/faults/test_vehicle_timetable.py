"""When faults of the vehicle begin and end."""

from math import ceil, inf

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.faults.schema import ForcedDisarm, FrozenTelemetry, PositionLoss
from sitl_shim.faults.vehicle import Timetable, lasts_s
from sitl_shim.wind.events import Moments

_TICKS = 500


def _frozen(at_s, lasts_s, since="boot"):
    return FrozenTelemetry(fault="frozen_telemetry", at_s=at_s, lasts_s=lasts_s, since=since)


def _run(faults, setpoints_tick=None):
    """(time, fault, begins) of everything that comes in 2 s of ticks."""
    moments = Moments()
    table = Timetable(tuple(faults), moments)
    found = []
    for tick in range(1, _TICKS + 1):
        time_s = tick * 0.004
        found += [(time_s, entry.fault, entry.begins) for entry in table.due(time_s)]
        if tick == setpoints_tick:
            moments.setpoints_s = time_s
    return found


@settings(deadline=None, derandomize=True)
@given(
    st.lists(
        st.tuples(
            st.floats(0.0, 2.5), st.floats(0.001, 2.5), st.sampled_from(["boot", "setpoints"])
        ),
        max_size=6,
    ),
    st.integers(1, _TICKS),
)
def test_each_begins_once_and_ends_once_at_its_tick_and_never_before(stretches, setpoints_tick):
    faults = [_frozen(*stretch) for stretch in stretches]
    found = _run(faults, setpoints_tick)
    last_s = _TICKS * 0.004
    for fault in faults:
        zero_s = setpoints_tick * 0.004 if fault.since == "setpoints" else 0.0
        earliest_s = zero_s + 0.004  # what counts from the setpoints is looked at a tick later
        for begins, at_s in ((True, fault.at_s), (False, fault.at_s + fault.lasts_s)):
            times = [time_s for time_s, which, begun in found if which is fault and begun is begins]
            expected_s = max(earliest_s, 0.004 * ceil((zero_s + at_s) / 0.004 - 1e-6))
            if expected_s > last_s + 1e-9:
                assert times == []
                break
            (time_s,) = times
            assert time_s == pytest.approx(expected_s, abs=1e-6)
            earliest_s = time_s + 0.004  # and lasts for a tick at least


def test_what_begins_when_its_like_ends_is_told_after_it():
    found = _run([_frozen(0.4, 0.4), _frozen(0.8, 0.4)])
    assert [(round(time_s, 3), begins) for time_s, _, begins in found] == [
        (0.4, True),
        (0.8, False),
        (0.8, True),
        (1.2, False),
    ]


def test_faults_of_one_moment_come_in_the_order_of_the_file():
    faults = [
        ForcedDisarm(fault="disarm", at_s=0.5),
        PositionLoss(fault="position_loss", at_s=0.5),
        ForcedDisarm(fault="disarm", at_s=0.1),
    ]
    assert [fault for _, fault, _ in _run(faults)] == [faults[2], faults[0], faults[1]]


def test_what_is_for_good_has_no_end():
    assert lasts_s(PositionLoss(fault="position_loss", at_s=0.5)) == inf
    assert [begins for _, _, begins in _run([PositionLoss(fault="position_loss", at_s=0.5)])] == [
        True
    ]
