"""Mean tracking errors: controllers × trajectories × winds, and how late each one is.

The paper's figures on PID-L1, LQR-L1 and MPC-L1, on the time response along trajectory 4, and on
MPC-PID and MPC-L1 with and without the fan.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.experiments.flight_table import FlightTable
from companion.experiments.flight_task import FlightTask
from companion.experiments.paper.flights import Flights, scored, vectors
from companion.experiments.paper.scale import TRAJECTORIES, VEHICLE, Scale
from companion.experiments.paper.statistics import Spread, spread
from companion.report.flight_data import Array
from companion.trajectories.harmonic import TEST_TRAJECTORIES

CONTROLLERS = ("pid-l1", "lqr-l1", "mpc-l1", "mpc-pid")
"""The paper's four."""
VARIANTS = ("pid-l1-error", "mpc-pid-joint")
"""Beside them: PID-L1 whose D acts on the error, and MPC-PID tuned as a whole on trajectory 4."""
WINDS = ("calm", "fan")
SHOWN = 4
"""The trajectory whose time response is shown."""

_LAGS_S = np.arange(-0.2, 3.0, 0.01)


@dataclass(frozen=True, slots=True)
class Errors:
    """Mean distance |y2* - y2| of a controller in a wind, m."""

    by_trajectory: dict[int, Spread]
    mean: Spread
    """Of the five trajectories, seed by seed."""
    tilt_slew_g_s: Spread
    """Rms rate of the tilt command, mean of the five trajectories, seed by seed: what an error
    does not show of a controller that chatters."""


@dataclass(frozen=True, slots=True)
class TimeResponse:
    """One flight along the shown trajectory."""

    times_s: Array
    desired_m: Array
    """(samples, 3)"""
    position_m: Array
    """(samples, 3), true."""
    lag_s: float
    """The shift in time of the desired path that brings it closest to the flown one."""


@dataclass(frozen=True, slots=True)
class Tracking:
    """All of it."""

    errors: dict[str, dict[str, Errors]]
    """By controller and wind."""
    responses: dict[str, TimeResponse]
    """By controller, calm."""
    commanded_minus_flown_m: float
    """Mean |r2 - y2| of MPC-L1: what the paper's e_j = r_2j - y_2j says literally."""


def task(controller: str, trajectory: int, wind: str, seed: int) -> FlightTask:
    """One flight of the comparison."""
    return FlightTask(controller, trajectory, wind, seed, VEHICLE)


def tasks(scale: Scale) -> list[FlightTask]:
    """What is flown."""
    return [
        task(controller, trajectory, wind, seed)
        for controller in (*CONTROLLERS, *VARIANTS)
        for wind in WINDS
        for trajectory in TRAJECTORIES
        for seed in scale.seeds
    ]


def evaluate(flights: Flights, scale: Scale) -> Tracking:
    """The comparison's figures."""
    errors = {
        controller: {wind: _errors(flights, scale, controller, wind) for wind in WINDS}
        for controller in (*CONTROLLERS, *VARIANTS)
    }
    tables = {
        controller: flights.table(task(controller, SHOWN, "calm", scale.seeds[0]))
        for controller in CONTROLLERS
    }
    responses = {
        controller: _response(table) for controller, table in tables.items() if table is not None
    }
    return Tracking(errors, responses, _commanded_minus_flown(tables["mpc-l1"]))


def _errors(flights: Flights, scale: Scale, controller: str, wind: str) -> Errors:
    summaries = {
        trajectory: [
            flights.summary(task(controller, trajectory, wind, seed)) for seed in scale.seeds
        ]
        for trajectory in TRAJECTORIES
    }
    values = {
        trajectory: [summary.mean_error_m for summary in of_trajectory]
        for trajectory, of_trajectory in summaries.items()
    }
    by_seed = list(zip(*summaries.values(), strict=True))
    means = [float(np.mean([s.mean_error_m for s in one_seed])) for one_seed in by_seed]
    slews = [float(np.mean([s.tilt_slew_rms_g_s for s in one_seed])) for one_seed in by_seed]
    return Errors({number: spread(v) for number, v in values.items()}, spread(means), spread(slews))


def _response(table: FlightTable) -> TimeResponse:
    rows = scored(table)
    times = table.columns["time_s"][rows].astype(np.float64)
    position = vectors(table, "true_position_{}_m")[rows]
    trajectory = TEST_TRAJECTORIES[SHOWN]
    known = np.isfinite(position).all(axis=1)
    distances = [
        np.linalg.norm(trajectory.position(times[known] - lag) - position[known], axis=1).mean()
        for lag in _LAGS_S
    ]
    lag_s = float(_LAGS_S[int(np.argmin(distances))])
    return TimeResponse(times, trajectory.position(times), position, lag_s)


def _commanded_minus_flown(table: FlightTable | None) -> float:
    if table is None:
        return math.nan
    rows = scored(table)
    distance = vectors(table, "r2_{}_m")[rows] - vectors(table, "true_position_{}_m")[rows]
    return float(np.nanmean(np.linalg.norm(distance, axis=1)))
