import math

import numpy as np

from companion.experiments.flight_store import (
    flight_path,
    read_flight_table,
    read_summary,
    summarise,
    write_flight,
)
from companion.experiments.flight_task import FlightTask
from tests.companion.experiments.stand_ins import table_of

TASK = FlightTask(
    "mpc-l1",
    "a/slalom.csv",
    wind="fan-4",
    seed=3,
    settings=(("hover_s", "1.5"), ("controller.l1.gamma", "[1.0, 2.0, 3.0]")),
    sensors="exact",
    shim_vehicle="plant.yaml",
)


def test_a_table_is_read_back_as_it_was_written(tmp_path):
    table = table_of(TASK, note="Größe", flown_s=2.0, scored_s=20.0, fallbacks=3, wall_s=1.25)
    path = flight_path(tmp_path, "key")

    write_flight(path, "key", table)
    read = read_flight_table(path)

    assert read.task == TASK
    assert repr(summarise("key", read)) == repr(summarise("key", table))  # NaN is not equal
    assert list(read.columns) == list(table.columns)
    for name, column in table.columns.items():
        assert read.columns[name].tolist() == column.astype(read.columns[name].dtype).tolist()
    assert read.columns["time_s"].dtype == np.float64
    assert read.columns["position_x_m"].dtype == np.float32
    assert read.columns["projecting"].dtype == bool
    assert read.columns["phase"].dtype.kind == "U"


def test_infinite_errors_and_unknown_figures_survive(tmp_path):
    table = table_of(
        TASK, mean_error_m=math.inf, rms_error_m=math.inf, max_error_m=math.inf, flown_s=0.0
    )
    path = flight_path(tmp_path, "key")

    write_flight(path, "key", table)
    summary = read_summary(path)

    assert (summary.mean_error_m, summary.rms_error_m, summary.max_error_m) == (math.inf,) * 3
    assert math.isnan(summary.wind_peak_m_s2)
    assert summary.flown_s == 0.0


def test_a_flight_without_rows_is_kept(tmp_path):
    path = flight_path(tmp_path, "key")
    table = table_of(TASK)
    table.columns.clear()

    write_flight(path, "key", table)

    assert read_flight_table(path).columns == {}
    assert read_summary(path).outcome == "tracked"
