import asyncio
import math
from dataclasses import replace

import numpy as np
import pytest

from companion.experiments.campaign import run_campaign
from companion.experiments.flight_store import flight_path, read_flight_table
from companion.experiments.flight_table import tilt_slew_rms_g_s
from companion.experiments.flight_task import FlightTask, load_task
from companion.experiments.fly_task import fly_task
from companion.experiments.memory_log import MemoryLog
from companion.flight.assemble import make_trajectory
from companion.flight.observer import SilentObserver
from companion.flight.records import CHANNELS
from companion.lockstep import fly_in_lockstep
from companion.recording.flight_log import FlightLog
from companion.report.flight_data import read_flight
from companion.report.metrics import tracking_figures
from tests.flights.bench import SHORT


@pytest.fixture(scope="module")
def task(tmp_path_factory):
    path = tmp_path_factory.mktemp("trajectory") / "short.csv"
    path.write_text(SHORT)
    return FlightTask("mpc-l1", str(path), wind="wind3", seed=5, settings=(("hover_s", "0.5"),))


@pytest.fixture(scope="module")
def table(task):
    return fly_task(task)


def test_the_figures_are_those_of_a_flight_that_was_logged_to_files(task, table, tmp_path):
    loaded = load_task(task)
    log = FlightLog(tmp_path, CHANNELS)
    trajectory = make_trajectory(loaded.config.mission)
    outcome = fly_in_lockstep(
        loaded.config, trajectory, log, SilentObserver(), loaded.shim, airborne=True
    )
    log.close()
    data = read_flight(tmp_path)
    logged = tracking_figures(data, outcome.scored_s)

    assert table.mean_error_m == pytest.approx(logged.against_truth.mean_m, rel=1e-10)
    assert table.rms_error_m == pytest.approx(logged.against_truth.rms_m, rel=1e-10)
    assert table.max_error_m == pytest.approx(logged.against_truth.max_m, rel=1e-10)
    assert table.reported_mean_error_m == pytest.approx(logged.as_reported.mean_m, rel=1e-10)
    assert table.wind_peak_m_s2 == logged.wind_peak_m_s2
    assert (table.outcome, table.fallbacks) == (outcome.outcome, outcome.fallbacks)
    engaged = data.ticks.phase != "hold"
    assert table.columns["sigma_hat_y"] == pytest.approx(
        data.ticks.sigma_hat[engaged, 1], rel=1e-10, nan_ok=True
    )


def test_the_table_has_the_flight_from_engagement_to_the_end_of_tracking(table):
    columns = table.columns
    rows = len(columns["time_s"])
    assert {len(column) for column in columns.values()} == {rows}
    assert table.outcome == "tracked"
    assert columns["time_s"][0] < -0.3
    assert "hold" not in columns["phase"]
    assert (columns["time_s"][columns["phase"] == "track"] >= -0.011).all()
    assert table.flown_s == table.scored_s == pytest.approx(4.0)
    assert set(columns["plan_status"]) <= {"", "closed_form", "solved", "clipped_closed_form"}
    assert 0.01 < table.wind_peak_m_s2 == pytest.approx(np.nanmax(columns["wind_m_s2"]), rel=0.2)
    assert 0.0 < table.tilt_slew_rms_g_s < 5.0


def test_columns_agree_with_each_other(table):
    columns = table.columns
    known = np.isfinite(columns["true_position_x_m"]) & np.isfinite(columns["r1_x_m_s"])
    assert known.mean() > 0.95
    gain = load_task(table.task).config.controller.l1.k
    for k, axis in enumerate("xyz"):
        reported, true = columns[f"position_{axis}_m"], columns[f"true_position_{axis}_m"]
        assert np.abs(reported - true)[known].max() < 0.05
        speed = np.gradient(true[known], columns["time_s"][known])
        stated = columns[f"true_velocity_{axis}_m_s"][known]
        assert np.abs(speed - stated)[2:-2].max() < 0.1
        r1 = gain[k] * (columns[f"r2_{axis}_m"] - reported)
        assert columns[f"r1_{axis}_m_s"][known] == pytest.approx(r1[known], abs=1e-9)


def test_the_peak_height_error_is_that_of_the_scored_part(table):
    columns = table.columns
    scored = (columns["time_s"] >= 0.0) & (columns["time_s"] <= table.scored_s)
    for peak, stem in (
        (table.peak_height_error_m, "true_position_z_m"),
        (table.reported_peak_height_error_m, "position_z_m"),
    ):
        errors = np.abs(columns["desired_z_m"] - columns[stem])[scored]
        assert peak == np.nanmax(errors)
        assert 0.001 < peak < table.max_error_m + 0.005


def test_a_flight_is_the_same_each_time_and_another_with_another_seed(task, table):
    assert fly_task(task).mean_error_m == table.mean_error_m
    assert fly_task(replace(task, seed=6)).mean_error_m != table.mean_error_m


def test_a_vehicle_that_is_lost_is_a_result(task, monkeypatch):
    def silent_after_six_seconds(data):
        return b"" if asyncio.get_running_loop().time() > 6.0 else data

    def lossy(*arguments, **options):
        return fly_in_lockstep(*arguments, **options | {"from_shim": silent_after_six_seconds})

    monkeypatch.setattr("companion.experiments.fly_task.fly_in_lockstep", lossy)

    lost = fly_task(task)

    assert lost.outcome == "aborted"
    assert "Nothing was heard" in lost.note
    assert (lost.mean_error_m, lost.rms_error_m, lost.max_error_m) == (math.inf,) * 3
    assert lost.reported_mean_error_m == math.inf
    assert 0.5 < lost.flown_s < 3.5
    assert lost.scored_s == pytest.approx(4.0)


def test_a_trajectory_that_the_vehicle_can_not_fly_is_refused(task):
    refused = fly_task(replace(task, settings=(("vehicle.speed_limit_m_s", "0.1"),)))

    assert refused.outcome == "refused"
    assert "0.1" in refused.note
    assert refused.columns == {}
    assert refused.mean_error_m == math.inf


def test_a_campaigns_flights_are_those_of_this_process(task, table, tmp_path):
    results = run_campaign([task], tmp_path, 1)

    summary = results[task.key]
    assert (summary.outcome, summary.mean_error_m) == ("tracked", table.mean_error_m)
    kept = read_flight_table(flight_path(tmp_path, task.key))
    assert kept.columns["u_x"] == pytest.approx(table.columns["u_x"], abs=1e-6, nan_ok=True)


def test_the_slew_of_a_tilt_that_swings_is_its_amplitude_times_its_frequency_by_root_two():
    times = np.arange(-1.0, 12.0, 0.001)
    swing = 0.1 * np.sin(2.0 * np.pi * times)
    columns = {"time_s": times, "applied_u_x": swing, "applied_u_y": np.zeros(len(times))}

    slew = tilt_slew_rms_g_s(columns, 10.0)

    assert slew == pytest.approx(0.1 * 2.0 * np.pi / math.sqrt(2.0), rel=1e-3)
    assert math.isnan(tilt_slew_rms_g_s(columns, -5.0))


def test_a_whole_flight_can_be_a_task_too(task):
    whole = fly_task(replace(task, wind="calm", airborne=False))
    assert whole.outcome == "landed"
    assert whole.mean_error_m < 0.05


class Errors(SilentObserver):
    def __init__(self):
        self.said = []

    def message(self, severity, text):
        self.said += [text] if severity == "error" else []


def test_a_flight_finds_in_a_memory_log_all_that_it_asks_of_a_log(task):
    loaded, errors = load_task(task), Errors()

    fly_in_lockstep(
        loaded.config,
        make_trajectory(loaded.config.mission),
        MemoryLog(),
        errors,
        loaded.shim,
        airborne=True,
    )

    assert errors.said == []
