import json
import math
from dataclasses import replace

import pytest

from companion.config.models import MissionConfig
from companion.flight.conduct import Outcome
from companion.flight.setpoints.timing import Percentiles
from companion.report.metrics import ErrorFigures, TrackingFigures
from companion.report.result import result_object, write_result

PROMISED = {
    "trajectory",
    "controller",
    "wind",
    "vehicle",
    "seed",
    "outcome",
    "mean_tracking_error_m",
    "rms_tracking_error_m",
    "max_tracking_error_m",
    "reported_mean_tracking_error_m",
    "fan_or_wind_peak_accel_m_s2",
    "ticks",
    "missed_deadlines",
    "fallbacks",
    "latency_ms",
    "flight_s",
    "wall_s",
    "log_dir",
}
FURTHER = {
    "completed",
    "note",
    "error_against",
    "r_max_active_share",
    "timer_noise_ms",
    "rejected_packets",
    "autopilot",
    "setpoint",
    "event",
    "controller_changes",
    "monitor_worst",
}

LANDED = Outcome(
    outcome="landed",
    completed=True,
    note="",
    scored_s=(20.0, 40.0),
    ticks=3900,
    missed_deadlines=1,
    fallbacks=2,
    latency=Percentiles(0.4, 0.9, 3.0),
    timer_noise=Percentiles(0.1, 0.2, 0.3),
    r_max_active_share=0.25,
    flight_s=56.2,
)
REFUSED = replace(
    LANDED, outcome="refused", completed=False, note="too fast", latency=None, timer_noise=None
)
TRUE = ErrorFigures(0.020004, 0.025, 0.06)
REPORTED = ErrorFigures(0.021, 0.026, 0.07)


def make(outcome=LANDED, figures=None, mission=None, log_dir=None):
    return result_object(mission or MissionConfig(), outcome, figures, wall_s=4.2, log_dir=log_dir)


def test_the_keys_are_those_that_are_promised_and_those_below(tmp_path):
    for outcome in (LANDED, REFUSED):
        assert set(make(outcome)) == PROMISED | FURTHER


def test_errors_are_against_the_truth_where_there_is_one():
    result = make(figures=TrackingFigures(TRUE, REPORTED, 1.2345))

    assert result["mean_tracking_error_m"] == 0.02
    assert result["rms_tracking_error_m"] == 0.025
    assert result["max_tracking_error_m"] == 0.06
    assert result["reported_mean_tracking_error_m"] == 0.021
    assert result["error_against"] == "truth"
    assert result["fan_or_wind_peak_accel_m_s2"] == 1.234


def test_errors_are_those_reported_where_there_is_no_truth():
    mission = MissionConfig(connect="udpin://127.0.0.1:14540")
    result = make(figures=TrackingFigures(None, REPORTED, None), mission=mission)

    assert result["mean_tracking_error_m"] == result["reported_mean_tracking_error_m"] == 0.021
    assert result["error_against"] == "reported position"
    assert (result["wind"], result["seed"]) == (None, None)
    assert result["fan_or_wind_peak_accel_m_s2"] is None


def test_a_flight_that_never_tracked_has_no_error():
    result = make(REFUSED)

    for key in ("mean", "rms", "max", "reported_mean"):
        assert result[f"{key}_tracking_error_m"] is None
    assert result["error_against"] is None
    assert result["latency_ms"] is None


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_becomes_null(tmp_path, bad):
    outcome = replace(LANDED, latency=Percentiles(bad, bad, bad), flight_s=bad)
    figures = TrackingFigures(ErrorFigures(bad, bad, bad), None, bad)

    write_result(tmp_path, make(outcome, figures))

    def refuse(constant):
        pytest.fail(f"{constant} is not JSON")

    text = (tmp_path / "result.json").read_text(encoding="utf-8")
    result = json.loads(text, parse_constant=refuse)
    assert result["latency_ms"] == {"p50": None, "p99": None, "max": None}
    assert result["flight_s"] is None
    assert result["mean_tracking_error_m"] is None


def test_the_file_says_what_the_object_says(tmp_path):
    result = make(figures=TrackingFigures(TRUE, REPORTED, 0.0), log_dir=tmp_path)

    write_result(tmp_path, result)

    assert json.loads((tmp_path / "result.json").read_text(encoding="utf-8")) == result
    assert result["log_dir"] == str(tmp_path)
