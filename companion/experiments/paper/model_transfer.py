"""MPC-PID whose model is tuned for one trajectory, flown on the others.

"We found that tuning this system model for each trajectory could improve performance for that
trajectory; however, doing so affected the performance of the other trajectories."
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.experiments.flight_task import FlightTask
from companion.experiments.paper.flights import Flights
from companion.experiments.paper.scale import TRAJECTORIES, VEHICLE, Scale
from companion.experiments.paper.statistics import Spread, spread
from companion.report.flight_data import Array


@dataclass(frozen=True, slots=True)
class ModelTransfer:
    """Mean errors in calm air, m."""

    errors_m: Array
    """(5, 5): row of the trajectory that the model was tuned for, column of the flown one."""
    identified: tuple[Spread, ...]
    """By flown trajectory: with the one model that was identified by steps."""

    @property
    def best_at_home(self) -> int:
        """On how many of the trajectories its own model is the best of the five."""
        return int((self.errors_m.argmin(axis=0) == np.arange(len(TRAJECTORIES))).sum())

    @property
    def gain_at_home(self) -> float:
        """Geometric mean of own model over identified one; below 1, tuning helps at home."""
        return _geometric_mean(np.diagonal(self._over_identified()))

    @property
    def loss_away(self) -> float:
        """Geometric mean, over all foreign trajectories, of foreign model over identified one."""
        return _geometric_mean(self._over_identified()[~np.eye(len(TRAJECTORIES), dtype=bool)])

    @property
    def harmed_away(self) -> float:
        """Share of the foreign cells that are worse than the trajectory's own model."""
        away = ~np.eye(len(TRAJECTORIES), dtype=bool)
        worse = self.errors_m > 1.02 * np.diagonal(self.errors_m)[None, :]
        return float(worse[away].mean())

    def _over_identified(self) -> Array:
        """(5, 5), not finite where either flight was lost."""
        identified = np.array(
            [s.mean if math.isfinite(s.mean) else math.nan for s in self.identified]
        )
        ratios: Array = self.errors_m / identified
        return ratios


def _geometric_mean(ratios: Array) -> float:
    """Infinite if a flight was lost."""
    return float(np.exp(np.log(ratios).mean())) if np.isfinite(ratios).all() else math.inf


def _task(model_of: int, flown: int, seed: int) -> FlightTask:
    return FlightTask(f"mpc-pid-t{model_of}", flown, "calm", seed, VEHICLE)


def _identified(flown: int, seed: int) -> FlightTask:
    return FlightTask("mpc-pid", flown, "calm", seed, VEHICLE)


def tasks(scale: Scale) -> list[FlightTask]:
    """What is flown."""
    tuned = [
        _task(model_of, flown, seed)
        for seed in scale.seeds
        for model_of in TRAJECTORIES
        for flown in TRAJECTORIES
    ]
    return tuned + [_identified(flown, seed) for seed in scale.seeds for flown in TRAJECTORIES]


def evaluate(flights: Flights, scale: Scale) -> ModelTransfer:
    """The table."""
    errors = np.array(
        [
            [
                np.mean([flights.summary(_task(row, column, s)).mean_error_m for s in scale.seeds])
                for column in TRAJECTORIES
            ]
            for row in TRAJECTORIES
        ]
    )
    identified = tuple(
        spread([flights.summary(_identified(n, s)).mean_error_m for s in scale.seeds])
        for n in TRAJECTORIES
    )
    return ModelTransfer(errors, identified)
