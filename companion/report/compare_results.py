"""What a comparison of controllers found: figures of each controller, wind and perturbation."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from companion.report.recovery_cell import RecoveryCell

NOMINAL = "nominal"
"""Name of the perturbation that is none."""


@dataclass(frozen=True, slots=True)
class Perturbed:
    """A perturbation, for a reader."""

    name: str
    says: str
    bearable: float
    """How many times its nominal error a robust controller may have."""


@dataclass(frozen=True, slots=True)
class Flown:
    """One flight's figures."""

    trajectory: str
    seed: int
    outcome: str
    note: str
    mean_error_m: float
    """Of |y2* - y2|; infinite if the trajectory was not flown to its end."""
    tilt_slew_rms_g_s: float
    peak_height_error_m: float

    @property
    def lost(self) -> bool:
        """Whether it did not come to the trajectory's end, and land if it had to."""
        return self.outcome not in ("tracked", "landed") or not math.isfinite(self.mean_error_m)


@dataclass(frozen=True, slots=True)
class Cell:
    """A controller's flights in one wind under one perturbation."""

    controller: str
    """Its label."""
    wind: str
    perturbation: str
    flights: tuple[Flown, ...]
    mean_error_m: float
    """Mean of the trajectories' means over the seeds; infinite if a flight was lost."""
    spread_m: float
    """Standard deviation over the seeds of the mean of the trajectories; NaN for one seed."""
    by_trajectory_m: dict[str, float]
    """Mean over the seeds."""
    tilt_slew_rms_g_s: float
    """Mean of the flights."""
    peak_height_error_m: float
    """Greatest of the flights."""

    @property
    def lost(self) -> int:
        """How many flights were lost."""
        return sum(flight.lost for flight in self.flights)


@dataclass(frozen=True, slots=True)
class Comparison:
    """All of it, and what it was made with."""

    vehicle: str
    autopilot: str
    setpoint: str
    sensors: str | None
    against: str
    """What the errors are against: "truth" or "reported" position."""
    whole: bool
    """From the ground to the ground."""
    controllers: tuple[str, ...]
    """Labels; ratios are to the first."""
    winds: tuple[str, ...]
    perturbations: tuple[Perturbed, ...]
    trajectories: tuple[str, ...]
    seeds: tuple[int, ...]
    cells: tuple[Cell, ...]
    command: str
    version: str
    commit: str
    recoveries: tuple[RecoveryCell, ...] = ()
    """Of the winds with a sudden event."""

    def cell(self, controller: str, wind: str, perturbation: str) -> Cell:
        """One cell."""
        return next(
            cell
            for cell in self.cells
            if (cell.controller, cell.wind, cell.perturbation) == (controller, wind, perturbation)
        )

    def to_first(self, cell: Cell) -> float:
        """Its error over the first controller's, in the same wind and under the same change."""
        first = self.cell(self.controllers[0], cell.wind, cell.perturbation)
        return ratio(cell.mean_error_m, first.mean_error_m)

    def to_nominal(self, cell: Cell) -> float:
        """Its error over that of the same controller and wind on the nominal vehicle."""
        nominal = self.cell(cell.controller, cell.wind, NOMINAL)
        return ratio(cell.mean_error_m, nominal.mean_error_m)

    def bears(self, cell: Cell) -> bool:
        """Whether nothing was lost, and the error is within what the perturbation allows."""
        if cell.lost:
            return False
        bearable = next(p.bearable for p in self.perturbations if p.name == cell.perturbation)
        return cell.perturbation == NOMINAL or self.to_nominal(cell) <= bearable


def make_cell(controller: str, wind: str, perturbation: str, flights: Sequence[Flown]) -> Cell:
    """The figures of flights on the same trajectories with each seed."""
    names = list(dict.fromkeys(flight.trajectory for flight in flights))
    by_trajectory = {
        name: _mean([f.mean_error_m for f in flights if f.trajectory == name]) for name in names
    }
    seeds = sorted({flight.seed for flight in flights})
    by_seed = [_mean([f.mean_error_m for f in flights if f.seed == seed]) for seed in seeds]
    slews = [f.tilt_slew_rms_g_s for f in flights if math.isfinite(f.tilt_slew_rms_g_s)]
    heights = [f.peak_height_error_m for f in flights if math.isfinite(f.peak_height_error_m)]
    return Cell(
        controller,
        wind,
        perturbation,
        tuple(flights),
        _mean(by_seed),
        _deviation(by_seed),
        by_trajectory,
        _mean(slews) if slews else math.nan,
        max(heights, default=math.nan),
    )


def file_name(name_or_path: str) -> str:
    """What a reader calls a scenario: its name, or its file's without folder and suffix."""
    return Path(name_or_path).stem if name_or_path.endswith((".yaml", ".yml")) else name_or_path


def ratio(value: float, of: float) -> float:
    """A ratio; infinite if the numerator is, NaN if there is nothing to relate it to."""
    if not math.isfinite(of) or of == 0.0:
        return math.nan
    return value / of


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def _deviation(values: Sequence[float]) -> float:
    """Of the sample (n - 1)."""
    mean = _mean(values)
    if len(values) < 2 or not math.isfinite(mean):
        return math.nan
    return math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (len(values) - 1))
