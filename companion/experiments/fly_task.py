"""Flies one task in this process, with nothing written to a file."""

import math
import time
from typing import TYPE_CHECKING, cast

from companion.experiments.flight_table import (
    FlightTable,
    flight_columns,
    peak_height_error_m,
    tilt_slew_rms_g_s,
)
from companion.experiments.flight_task import FlightTask, LoadedTask, load_task
from companion.experiments.memory_log import MemoryLog
from companion.flight.assemble import infeasibilities, make_trajectory
from companion.flight.conduct import Outcome
from companion.flight.observer import SilentObserver
from companion.lockstep import fly_in_lockstep
from companion.report.metrics import event_while_scored, tracking_figures
from companion.trajectories.trajectory import Trajectory

if TYPE_CHECKING:
    from companion.recording.flight_log import FlightLog


def fly_task(task: FlightTask) -> FlightTable:
    """Fly a task.

    A vehicle that is lost or a flight that is refused is a result: its errors are infinite.

    Raises:
        ConfigError: the task's files can't be used.
        TrajectoryFileError: its trajectory can't.
        ShimRefusedError: the shim can't simulate it.
    """
    return fly_loaded_task(task, load_task(task))[0]


def fly_loaded_task(
    task: FlightTask, loaded: LoadedTask, log: MemoryLog | None = None
) -> tuple[FlightTable, Outcome | None]:
    """Fly a task whose files have been read.

    Args:
        task: what the table calls it.
        loaded: what is flown.
        log: takes the flight's records; an empty one by default.

    Returns:
        Its data and figures, and how it ended; None if it was refused before it began.

    Raises:
        TrajectoryFileError: its trajectory can't be used.
        ShimRefusedError: the shim can't simulate it.
    """
    started = time.perf_counter()
    config = loaded.config
    trajectory = make_trajectory(config.mission)
    problems = infeasibilities(trajectory, config.mission, config.vehicle)
    if problems:
        return _unflown(task, "\n".join(problems)), None
    log = MemoryLog() if log is None else log
    outcome = fly_loaded(loaded, trajectory, log, airborne=task.airborne)
    return _table(task, outcome, log, started), outcome


def _table(task: FlightTask, outcome: Outcome, log: MemoryLog, started: float) -> FlightTable:
    if outcome.scored_s is None:
        return _unflown(task, outcome.note, outcome.outcome)
    data = log.data()
    columns = flight_columns(data, outcome.scored_s[0])
    figures = tracking_figures(data, outcome.scored_s)
    true = figures.against_truth if outcome.completed else None
    reported = figures.as_reported if outcome.completed else None
    scored_s = outcome.scored_s[1] - outcome.scored_s[0]
    event = event_while_scored(data.truth.events, outcome.scored_s)
    last_s = float(columns["time_s"][-1]) if len(columns["time_s"]) else 0.0
    return FlightTable(
        task=task,
        outcome=outcome.outcome,
        note=outcome.note,
        columns=columns,
        mean_error_m=math.inf if true is None else true.mean_m,
        rms_error_m=math.inf if true is None else true.rms_m,
        max_error_m=math.inf if true is None else true.max_m,
        reported_mean_error_m=math.inf if reported is None else reported.mean_m,
        peak_height_error_m=peak_height_error_m(columns, scored_s, "true_position"),
        reported_peak_height_error_m=peak_height_error_m(columns, scored_s, "position"),
        flown_s=max(0.0, min(scored_s, last_s)),
        scored_s=scored_s,
        fallbacks=outcome.fallbacks,
        r_max_share=outcome.r_max_active_share,
        wind_peak_m_s2=_or_nan(figures.wind_peak_m_s2),
        tilt_slew_rms_g_s=tilt_slew_rms_g_s(columns, scored_s),
        event="" if event is None else event.text,
        event_s=math.nan if event is None else event.time_s - outcome.scored_s[0],
        wall_s=time.perf_counter() - started,
    )


def fly_loaded(
    loaded: LoadedTask,
    trajectory: Trajectory,
    log: MemoryLog,
    *,
    airborne: bool,
) -> Outcome:
    """Fly any trajectory with a task's controller, vehicle and weather.

    Raises:
        ConfigError: the controller's gains are not ones that its laws are made for.
        ShimRefusedError: the shim can't simulate it.
    """
    return fly_in_lockstep(
        loaded.config,
        trajectory,
        cast("FlightLog", log),  # all that a flight asks of one is what a MemoryLog has
        SilentObserver(),
        loaded.shim,
        airborne=airborne,
    )


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _unflown(task: FlightTask, note: str, outcome: str = "refused") -> FlightTable:
    """A flight that never tracked: no rows, infinite errors."""
    inf = math.inf
    return FlightTable(task, outcome, note, {}, inf, inf, inf, flown_s=0.0)
