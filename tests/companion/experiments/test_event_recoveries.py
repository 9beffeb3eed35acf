import io
import math
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from companion.experiments.event_recoveries import draw_events, event_flights, table_curve
from companion.experiments.flight_store import flight_path, summarise, write_flight
from companion.experiments.flight_table import FlightTable
from companion.experiments.flight_task import FlightTask
from companion.experiments.fly_task import fly_task
from companion.report.recovery import Recovery
from companion.report.recovery_cell import recovery_cell
from companion.report.recovery_table import recovery_table
from tests.flights.bench import SHORT

EVENT_S = 5.0
DROP = "payload dropped"


def table(task, *, off_s, off_m=0.3, event=DROP):
    """At 100 Hz, off in height (as reported: twice as much) for a while after the event."""
    times = np.arange(-1.0, 11.0, 0.01)
    off = np.where((times >= EVENT_S) & (times < EVENT_S + off_s), off_m, 0.0)
    nothing = np.zeros(len(times))
    columns = {"time_s": times, "roll_rad": nothing, "pitch_rad": nothing, "thrust": nothing + 0.5}
    for axis, error in (("x", nothing), ("y", nothing), ("z", off)):
        columns[f"desired_{axis}_m"] = nothing
        columns[f"true_position_{axis}_m"] = error
        columns[f"position_{axis}_m"] = 2.0 * error
    return FlightTable(
        task, "tracked", "", columns, 0.01, 0.01, 0.01, scored_s=10.0, flown_s=10.0,
        event=event, event_s=EVENT_S if event else math.nan,
    )  # fmt: skip


def kept(folder, flights):
    """Summaries by key of tables that are kept in a folder."""
    summaries = {}
    for number, flight in enumerate(flights):
        key = f"flight-{number}"
        if flight.columns:
            write_flight(flight_path(folder, key), key, flight)
        summaries[key] = summarise(key, flight)
    return summaries


def task(seed, controller="mpc-l1", wind="payload-drop"):
    return FlightTask(controller, 4, wind, seed)


@pytest.mark.parametrize(("against", "factor"), [("truth", 1.0), ("reported", 2.0)])
def test_each_place_has_the_figures_of_its_flights(tmp_path, against, factor):
    planned = {
        ("a", "payload-drop", "nominal"): [task(1), task(2), task(3)],
        ("a", "calm", "nominal"): [task(1, wind="calm")],
        ("b", "payload-drop", "nominal"): [task(1, "pid-l1")],
    }
    flown = [
        table(task(1), off_s=0.5),
        table(task(2), off_s=1.0, off_m=0.2),
        table(task(3), off_s=1.5, off_m=0.1),
        table(task(1, wind="calm"), off_s=0.0, event=""),
        table(task(1, "pid-l1"), off_s=4.5),
    ]
    found = event_flights(planned, kept(tmp_path, flown), tmp_path, against)
    assert [flights.place[0] for flights in found] == ["a", "b"]
    first, second = (flights.cell for flights in found)
    assert first.event == DROP
    assert (first.flown, first.not_back) == (3, 0)
    assert first.peak_height_m == pytest.approx(0.3 * factor)
    assert first.recovery_s == pytest.approx(1.0, abs=0.02)
    assert first.longest_recovery_s == pytest.approx(1.5, abs=0.02)
    assert (second.not_back, second.longest_recovery_s) == (1, math.inf)


def test_a_flight_that_was_lost_before_the_event_is_not_back(tmp_path):
    lost = FlightTable(task(2), "aborted", "lost", {}, math.inf, math.inf, math.inf)
    planned = {("a", "payload-drop", "nominal"): [task(1), task(2)]}
    summaries = kept(tmp_path, [table(task(1), off_s=1.0), lost])
    (flights,) = event_flights(planned, summaries, tmp_path, "truth")
    assert (flights.cell.flown, flights.cell.not_back) == (2, 1)
    assert flights.cell.longest_recovery_s == math.inf


def test_a_flight_that_was_lost_after_the_event_is_not_back(tmp_path):
    fallen = replace(table(task(2), off_s=1.0), outcome="aborted", note="fell")
    blind = table(task(3), off_s=1.0)
    for axis in "xyz":
        truth = blind.columns[f"true_position_{axis}_m"].copy()
        truth[blind.columns["time_s"] > EVENT_S + 4.0] = math.nan
        blind.columns[f"true_position_{axis}_m"] = truth
    planned = {("a", "payload-drop", "nominal"): [task(1), task(2), task(3)]}
    flown = [table(task(1), off_s=1.0), fallen, blind]
    (flights,) = event_flights(planned, kept(tmp_path, flown), tmp_path, "truth")
    assert (flights.cell.flown, flights.cell.not_back) == (3, 2)
    assert [curve.recovery.recovery_s for curve in flights.curves[1:]] == [math.inf, math.inf]


def test_there_is_a_picture_for_each_wind_with_an_event_and_none_for_perturbed_flights(tmp_path):
    winds = ("payload-drop", "gust-front")
    planned = {(label, wind, "nominal"): [task(1, label, wind)] for label in "ab" for wind in winds}
    planned["a", "payload-drop", "lag+25"] = [task(9)]
    flown = [table(tasks[0], off_s=1.0) for tasks in planned.values()]
    found = event_flights(planned, kept(tmp_path, flown), tmp_path, "truth")
    assert len(found) == 5
    paths = draw_events(found, "bebop2", tmp_path)
    names = ["recovery-payload-drop.png", "recovery-gust-front.png"]
    assert [path.name for path in paths] == names
    assert all(path.stat().st_size > 10_000 for path in paths)


def test_the_table_names_what_is_not_back():
    back = Recovery(5.0, 0.035, 0.012, 0.003, 0.01, 0.42)
    gone = replace(back, recovery_s=math.inf)
    cells = [
        recovery_cell(("a", "payload-drop", "nominal"), DROP, 2, [back, back]),
        recovery_cell(("b", "payload-drop", "nominal"), DROP, 2, [back, gone]),
    ]
    shown = io.StringIO()
    Console(file=shown, width=150).print(recovery_table(cells))
    lines = shown.getvalue().splitlines()
    (first,) = (line for line in lines if "│ a " in line)
    (second,) = (line for line in lines if "│ b " in line)
    assert [word in first for word in ("35", "12", "0.42", "all 2 back")] == [True] * 4
    assert "1 of 2 not back" in second


@pytest.mark.parametrize(
    ("autopilot", "vehicle"), [("px4", "bebop2"), ("ardupilot", "bebop2"), ("px4", "x500")]
)
def test_a_flown_event_is_in_the_flights_table_with_its_time(tmp_path, autopilot, vehicle):
    trajectory = tmp_path / "short.csv"
    trajectory.write_text(SHORT)
    scenario = tmp_path / "drop.yaml"
    scenario.write_text(
        "name: drop\nwinds: []\npayload:\n  - {at_s: 0.0, mass_share: 0.15}\n"
        "  - {at_s: 2.0, since: setpoints, mass_share: 0.0}\n"
    )
    settings = (("hover_s", "0.5"), ("autopilot", autopilot))
    flown = fly_task(
        FlightTask("mpc-l1", str(trajectory), str(scenario), 5, vehicle, settings=settings)
    )
    assert flown.outcome == "tracked"
    assert flown.event == DROP
    # Set-points are followed from the engagement on, which is the table's first row.
    engaged_s = flown.columns["time_s"][0]
    assert flown.event_s == pytest.approx(engaged_s + 2.0, abs=0.05)
    curve = table_curve(flown, "mpc-l1", "truth")
    # Lighter by 15 %, it jumps up; by 15 mm at least, and by less than the goal of 0.15 m.
    after = curve.error_times_s > 0.0
    assert 0.015 < curve.error_enu_m[after, 2].max() < 0.15
    assert curve.recovery.peak_height_m == pytest.approx(abs(curve.error_enu_m[after, 2]).max())
