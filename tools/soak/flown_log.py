"""How long a flight's ticks took, from its own log."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from companion.recording.flight_log import MCAP_NAME
from companion.recording.mcap_log import read_records


@dataclass(frozen=True, slots=True)
class Window:
    """A stretch of a flight."""

    time_s: float
    """Its middle, by the loop's clock."""
    p99_ms: float
    ticks: int


def windows(folder: Path, field: str, per_ms: float, length_s: float) -> list[Window]:
    """99th percentiles of a control record's field while the trajectory was flown.

    Args:
        folder: of the log.
        field: `latency_s`, or `computed_us`.
        per_ms: what 1 ms is in the field's unit.
        length_s: of a window; what is left over at the end is left out.
    """
    found: list[Window] = []
    begun_s, values = 0.0, list[float]()
    for time_s, value in _ticks(folder, field):
        if not values:
            begun_s = time_s
        values.append(value / per_ms)
        if time_s - begun_s >= length_s:
            p99_ms = float(np.percentile(values, 99.0))
            found.append(Window(0.5 * (begun_s + time_s), p99_ms, len(values)))
            values = []
    return found


def p99_ms(folder: Path, field: str, per_ms: float) -> float | None:
    """Of the whole trajectory; see `windows`.  None if nothing of it was flown."""
    values = [value / per_ms for _, value in _ticks(folder, field)]
    return float(np.percentile(values, 99.0)) if values else None


def _ticks(folder: Path, field: str) -> Iterator[tuple[float, float]]:
    for record in read_records(folder / MCAP_NAME):
        values = record.values
        if record.topic == "control" and values["phase"] == "track":
            yield values["received_s"], values[field]
