import io
from dataclasses import replace

import pytest
from rich.console import Console

from companion.config.models import MissionConfig
from companion.flight.conduct import Outcome
from companion.flight.setpoints.timing import Percentiles
from companion.report.metrics import ErrorFigures, TrackingFigures
from companion.report.result import result_object
from companion.report.summary import print_summary

LANDED = Outcome("landed", True, "", (20.0, 40.0), 3900, 0, 0, None, None, 0.0, 56.2)
FIGURES = TrackingFigures(
    ErrorFigures(0.0302, 0.0377, 0.0993), ErrorFigures(0.0303, 0.0378, 0.1007), 1.402
)


def show(outcome, figures=FIGURES, *, log_dir=None, terminal=False, width=80, **mission):
    shown = io.StringIO()
    console = Console(
        file=shown, force_terminal=terminal, width=width, color_system=None, highlight=False
    )
    result = result_object(MissionConfig(**mission), outcome, figures, wall_s=2.6, log_dir=log_dir)
    print_summary(console, result)
    return [line.rstrip() for line in shown.getvalue().splitlines()]


def test_a_flight_in_simulation(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    assert show(LANDED, log_dir=tmp_path / "flights" / "a", seed=1, wind="fan") == [
        "outcome         landed",
        "flight          trajectory 4, mpc-l1, bebop2, wind fan, seed 1",
        "tracking error  30.2 mm mean, 37.7 rms, 99.3 max, against truth",
        "                30.3 mm mean, as the autopilot reported it",
        "wind            pushed with 1.40 m/s² at most",
        "control         3900 ticks, 0 deadlines missed, 0 on a fallback",
        "time            56.2 s flown in 2.6 s (21.6 ×)",
        "files           flights/a",
    ]


def test_a_real_flight_has_neither_wind_nor_seed_and_says_what_its_error_is_against():
    lines = show(
        replace(LANDED, latency=Percentiles(0.5, 1.2, 2.0), timer_noise=Percentiles(0.1, 0.4, 1.0)),
        TrackingFigures(None, FIGURES.as_reported, None),
        connect="udpin://127.0.0.1:14540",
    )

    assert lines[1] == "flight          trajectory 4, mpc-l1, bebop2, a real vehicle"
    assert lines[2].endswith("30.3 mm mean, 37.8 rms, 100.7 max, against reported position")
    assert lines[4] == (
        "latency         p50 0.50, p99 1.20, max 2.00 ms (machine's timers: p99 0.40)"
    )


def test_a_flight_that_never_tracked_shows_why_and_no_figures():
    refused = replace(
        LANDED, outcome="refused", completed=False, note="not ready", scored_s=None, ticks=0
    )
    refused = replace(refused, flight_s=0.0)

    lines = show(refused, None)

    assert lines[:2] == ["outcome         refused", "                not ready"]
    assert len(lines) == 3


def test_landing_early_is_no_success():
    early = replace(LANDED, completed=False, note="landed early by command")

    assert show(early)[:2] == [
        "outcome         landed, the trajectory was not flown to its end",
        "                landed early by command",
    ]


@pytest.mark.parametrize("terminal", [False, True])
def test_the_folder_is_on_one_line_however_long(tmp_path, terminal):
    folder = tmp_path / ("long" * 30)

    assert show(LANDED, log_dir=folder, terminal=terminal)[-1].endswith(str(folder))


def test_nothing_that_a_person_named_is_taken_for_markup():
    lines = show(LANDED, trajectory="[bold]x[/].csv")

    assert "trajectory [bold]x[/].csv, mpc-l1" in lines[1]


def test_in_a_file_no_line_ends_in_blanks_and_on_a_narrow_terminal_all_fit():
    result = result_object(MissionConfig(wind="fan"), LANDED, FIGURES, wall_s=2.6, log_dir=None)
    for terminal, width in ((False, 1000), (True, 60)):
        shown = io.StringIO()
        print_summary(
            Console(file=shown, force_terminal=terminal, width=width, color_system=None), result
        )
        lines = shown.getvalue().splitlines()
        if terminal:
            assert max(map(len, lines)) <= width
        else:
            assert lines == [line.rstrip() for line in lines]


def test_one_deadline_is_one():
    lines = show(replace(LANDED, missed_deadlines=1))
    assert "control         3900 ticks, 1 deadline missed, 0 on a fallback" in lines
