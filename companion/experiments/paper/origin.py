"""The laboratory's origin moved: it pulls R on the absolute reference, and not R on r - y*."""

import math
from dataclasses import dataclass

import numpy as np

from companion.config.resolve import configs_folder
from companion.experiments.flight_task import FlightTask
from companion.experiments.paper.flights import Flights, scored, vectors
from companion.experiments.paper.scale import VEHICLE, Scale

SHIFT_ENU_M = (5.0, -3.0, 0.0)
COSTS = ("r_minus_target", "absolute_r")
TRAJECTORY = 4
_HERE = (0.0, 0.0, 0.0)
_FENCE = (("geofence.low_m", "[-12, -12, 0.2]"), ("geofence.high_m", "[12, 12, 6]"))


@dataclass(frozen=True, slots=True)
class CostFigures:
    """Of MPC-L1 with one of the two costs, m."""

    error_here_m: float
    """Mean error on the trajectory about the origin."""
    error_there_m: float
    """The same trajectory, moved."""
    hover_offset_m: float
    """Distance of the mean position in a hover at the shifted point from that point."""
    largest_change: float = math.nan
    """Of the error by moving the origin, over all trajectories flown there, as a share."""

    @property
    def change(self) -> float:
        """Of the error by moving the origin, as a share."""
        return abs(self.error_there_m - self.error_here_m) / self.error_here_m


def _fly(trajectory: int | str, cost: str, origin: tuple[float, ...], seed: int) -> FlightTask:
    where = (("origin.at", "local"), ("origin.offset_enu_m", str(list(origin))))
    settings = (*where, ("controller.mpc.penalise", cost), *_FENCE)
    return FlightTask("mpc-l1", trajectory, "calm", seed, VEHICLE, settings)


def _hover(cost: str, seed: int) -> FlightTask:
    return _fly(str(configs_folder() / "trajectories" / "hover.yaml"), cost, SHIFT_ENU_M, seed)


def tasks(scale: Scale) -> list[FlightTask]:
    """What is flown."""
    seed = scale.seeds[0]
    flown = [
        _fly(trajectory, cost, where, seed)
        for cost in COSTS
        for trajectory in scale.origin_trajectories
        for where in (_HERE, SHIFT_ENU_M)
    ]
    return flown + [_hover(cost, seed) for cost in COSTS]


def evaluate(flights: Flights, scale: Scale) -> dict[str, CostFigures]:
    """Figures by cost."""
    seed = scale.seeds[0]
    return {
        cost: CostFigures(
            flights.summary(_fly(TRAJECTORY, cost, _HERE, seed)).mean_error_m,
            flights.summary(_fly(TRAJECTORY, cost, SHIFT_ENU_M, seed)).mean_error_m,
            _offset(flights, _hover(cost, seed)),
            max(_change(flights, n, cost, seed) for n in scale.origin_trajectories),
        )
        for cost in COSTS
    }


def _change(flights: Flights, trajectory: int, cost: str, seed: int) -> float:
    here, there = (
        flights.summary(_fly(trajectory, cost, where, seed)).mean_error_m
        for where in (_HERE, SHIFT_ENU_M)
    )
    return abs(there - here) / here if math.isfinite(here + there) else math.inf


def _offset(flights: Flights, task: FlightTask) -> float:
    table = flights.table(task)
    if table is None:
        return math.inf
    rows = scored(table) & (table.columns["time_s"] > 0.5 * table.scored_s)
    off = vectors(table, "true_position_{}_m")[rows] - vectors(table, "desired_{}_m")[rows]
    return float(np.linalg.norm(np.nanmean(off, axis=0)))
