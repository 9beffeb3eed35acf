"""The flights of a study, by task."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from companion.experiments.flight_store import Summary, flight_path, read_flight_table
from companion.experiments.flight_table import FlightTable
from companion.experiments.flight_task import FlightTask
from companion.report.flight_data import Array

_AXES = "xyz"


class Flights:
    """Flown tasks with their figures; the data of each are read when they are asked for."""

    def __init__(self, folder: Path, summaries: Mapping[str, Summary]) -> None:
        """Of a campaign's folder and its figures by key."""
        self._folder = folder
        self._by_task = {summary.task: summary for summary in summaries.values()}

    def summary(self, task: FlightTask) -> Summary:
        """Figures of a task's flight."""
        return self._by_task[task]

    def table(self, task: FlightTask) -> FlightTable | None:
        """Data of a task's flight; None if it was not flown to its end, or can't be read."""
        summary = self._by_task[task]
        if not math.isfinite(summary.mean_error_m):
            return None
        try:
            return read_flight_table(flight_path(self._folder, summary.key))
        except (OSError, ValueError):
            return None


def vectors(table: FlightTable, name: str) -> Array:
    """The three columns of a vector as (samples, 3); ``{}`` in the name stands for the axis."""
    columns = [table.columns[name.format(axis)] for axis in _AXES]
    return np.stack(columns, axis=1).astype(np.float64)


def scored(table: FlightTable) -> np.ndarray:
    """Marks the samples of the scored part."""
    times = table.columns["time_s"]
    inside: np.ndarray = (times >= 0.0) & (times <= table.scored_s)
    return inside
