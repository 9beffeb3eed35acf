from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.report.flight_data import FlightData
from companion.report.metrics import reported_error, tracking_figures, true_error
from tests.companion.report.synthetic_flight import (
    NO_TRUTH,
    circle,
    make_flight,
    make_ticks,
    make_truth,
)

SCORED_S = (5.0, 25.0)
millimetres = st.floats(-0.2, 0.2)


@given(offset=st.tuples(millimetres, millimetres, millimetres))
@settings(deadline=None, derandomize=True, max_examples=25)
def test_a_constant_offset_is_mean_rms_and_maximum(offset):
    figures = tracking_figures(make_flight(true_offset_m=offset), SCORED_S)

    distance = float(np.linalg.norm(offset))
    true = figures.against_truth
    assert (true.mean_m, true.rms_m, true.max_m) == pytest.approx((distance,) * 3, abs=2e-5)


def test_the_reported_error_is_that_of_the_reported_position_alone():
    data = make_flight(offset_m=(0.03, 0.0, 0.0), true_offset_m=(0.0, 0.0, 0.04))

    figures = tracking_figures(data, SCORED_S)

    assert figures.as_reported.mean_m == pytest.approx(0.03, abs=1e-9)
    assert figures.against_truth.mean_m == pytest.approx(0.04, abs=2e-5)


def test_mean_rms_and_maximum_differ_as_they_should():
    times = np.arange(0.0, 4.0, 0.01)
    position = circle(times)
    position[::2, 2] += 0.06
    data = FlightData(make_ticks(times, position, circle(times)), NO_TRUTH)

    figures = tracking_figures(data, (0.0, 4.0)).as_reported

    assert figures.mean_m == pytest.approx(0.03)
    assert figures.rms_m == pytest.approx(0.06 / np.sqrt(2.0))
    assert figures.max_m == pytest.approx(0.06)


def test_a_vehicle_that_is_20_ms_late_at_1_m_per_s_is_20_mm_behind():
    times = np.arange(0.0, 30.0, 0.01)
    true_times = np.arange(0.0, 30.0, 0.004)
    ticks = make_ticks(times, circle(times), circle(times))
    data = FlightData(ticks, make_truth(true_times, circle(true_times - 0.02)))

    figures = tracking_figures(data, SCORED_S)

    assert figures.against_truth.mean_m == pytest.approx(0.02, rel=1e-3)
    assert figures.as_reported.mean_m == pytest.approx(0.0, abs=1e-12)


def test_without_truth_there_are_figures_as_reported_only():
    figures = tracking_figures(make_flight(offset_m=(0.0, 0.05, 0.0)), SCORED_S)

    assert figures.against_truth is None
    assert figures.wind_peak_m_s2 is None
    assert figures.as_reported.max_m == pytest.approx(0.05)


def test_nothing_recorded_gives_no_figures():
    empty = make_ticks(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))

    figures = tracking_figures(FlightData(empty, NO_TRUTH), SCORED_S)

    assert (figures.against_truth, figures.as_reported, figures.wind_peak_m_s2) == (None,) * 3


def test_only_the_scored_part_counts():
    data = make_flight(true_offset_m=(0.0, 0.0, 0.0))
    position = data.truth.position_enu_m.copy()
    position[data.truth.time_s < SCORED_S[0]] += 1.0
    position[data.truth.time_s > SCORED_S[1]] += 1.0
    data = FlightData(data.ticks, replace(data.truth, position_enu_m=position))

    assert tracking_figures(data, SCORED_S).against_truth.max_m < 1e-4


def test_truth_after_the_companion_stopped_flying_is_not_scored():
    data = make_flight(true_offset_m=(0.0, 0.0, 0.0))
    flown = data.ticks.time_s < 10.0
    ticks = make_ticks(
        data.ticks.time_s[flown], circle(data.ticks.time_s[flown]), circle(data.ticks.time_s[flown])
    )

    times, error = true_error(FlightData(ticks, data.truth), SCORED_S)

    assert times[-1] < 10.0
    assert error.max() < 1e-4


def test_ticks_without_a_reference_or_a_position_are_left_out():
    data = make_flight(offset_m=(0.02, 0.0, 0.0), true_offset_m=(0.0, 0.02, 0.0))
    desired = data.ticks.desired_enu_m.copy()
    position = data.ticks.position_enu_m.copy()
    desired[:600] = np.nan
    position[700:705] = np.nan
    ticks = make_ticks(data.ticks.time_s, position, desired)
    data = FlightData(ticks, data.truth)

    times, error = reported_error(data, SCORED_S)
    assert len(times) == 2001 - 100 - 5
    assert error == pytest.approx(np.full(len(error), 0.02))
    true_times, true = true_error(data, SCORED_S)
    assert true_times[0] >= 6.0
    assert true.max() == pytest.approx(0.02, abs=2e-5)


def test_missing_telemetry_does_not_invent_an_error_against_the_truth():
    data = make_flight(true_offset_m=(0.0, 0.0, 0.0))
    heard = (data.ticks.time_s < 12.0) | (data.ticks.time_s > 12.5)
    times = data.ticks.time_s[heard]
    ticks = make_ticks(times, circle(times), circle(times))

    # A straight line over half a second of this circle would be 31 mm off.
    assert tracking_figures(FlightData(ticks, data.truth), SCORED_S).against_truth.max_m < 1e-3


def test_the_greatest_push_of_the_wind_is_that_while_scored():
    data = make_flight(true_offset_m=(0.0, 0.0, 0.0))
    wind = np.full(len(data.truth.time_s), 0.2)
    wind[data.truth.time_s < 4.0] = 9.0
    wind[len(wind) // 2] = 1.4
    data = FlightData(data.ticks, replace(data.truth, wind_acceleration_m_s2=wind))

    assert tracking_figures(data, SCORED_S).wind_peak_m_s2 == 1.4
