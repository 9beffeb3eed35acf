"""Reads a campaign's folder: what was planned, and the rows of what was flown."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.config.yaml_source import ConfigError
from companion.experiments.campaigns.manifest import MANIFEST, Manifest, read_manifest
from companion.experiments.campaigns.plan import Parameter
from companion.experiments.campaigns.results import JOURNAL, RESULTS, read_journal
from companion.experiments.flight_store import FAILED, need_pyarrow
from companion.report.flight_data import Array

__all__ = ["Campaign", "Flights", "Parameter", "read_campaign"]

_TEXTS = ("key", "outcome", "note")
_NUMBERS = ("mean_error_m", "max_error_m", "flown_s", "scored_s")
_WHAT_IT_IS = "Is this the folder that `companion campaign` or `companion fly` wrote?"

Column = NDArray[Any]


@dataclass(frozen=True, slots=True)
class Flights:
    """Flights of a campaign, a row each, in the order of its plan."""

    point: NDArray[np.int64]
    values: Mapping[str, Column]
    """By parameter: numbers, or texts."""
    outcome: Column
    note: Column
    mean_error_m: Array
    """Infinite where the vehicle did not track to the end."""
    max_error_m: Array
    flown_s: Array
    scored_s: Array

    @property
    def lost(self) -> NDArray[np.bool_]:
        """Those that did not track to the end."""
        return ~np.isfinite(self.mean_error_m)

    def __len__(self) -> int:
        return len(self.point)

    def take(self, which: NDArray[Any]) -> "Flights":
        """Some of them, by places or by a mask."""
        return Flights(
            self.point[which],
            {name: column[which] for name, column in self.values.items()},
            self.outcome[which],
            self.note[which],
            self.mean_error_m[which],
            self.max_error_m[which],
            self.flown_s[which],
            self.scored_s[which],
        )


@dataclass(frozen=True, slots=True)
class Campaign:
    """A campaign's folder."""

    folder: Path
    manifest: Manifest
    parameters: tuple[Parameter, ...]
    """Those that vary."""
    flights: Flights
    """That ended, however they did."""
    unflown: Flights
    """That the program could not fly at all; nothing is known of the vehicle by them."""

    @property
    def missing(self) -> int:
        """Flights of the plan of which there is no row."""
        return max(0, self.manifest.flights - len(self.flights) - len(self.unflown))

    def parameter(self, name: str) -> Parameter | None:
        """The one of a name, if it varies."""
        return next((p for p in self.parameters if p.name == name), None)


def read_campaign(folder: Path) -> Campaign:
    """Read a folder, of a campaign that is running or was killed too.

    Raises:
        ConfigError: it is no campaign's, nothing was flown yet, or a file in it is damaged.
        MissingExtraError: pyarrow is not installed.
        OSError: a file can't be read.
    """
    if not folder.is_dir():
        raise ConfigError(f"{folder}: no such folder. {_WHAT_IT_IS}")
    manifest = _manifest(folder)
    need_pyarrow()
    columns = _columns(folder, manifest)
    flights = _flights(columns, manifest.parameters)
    if not len(flights):
        raise ConfigError(f"{folder}: no flight has ended yet. Ask again when one has.")
    unflown = flights.outcome == FAILED
    parameters = tuple(p for p in manifest.parameters if len(np.unique(flights.values[p.name])) > 1)
    return Campaign(folder, manifest, parameters, flights.take(~unflown), flights.take(unflown))


def _manifest(folder: Path) -> Manifest:
    try:
        manifest = read_manifest(folder)
    except ConfigError as error:
        raise ConfigError(
            f"{folder / MANIFEST}: not what a campaign writes ({error.__cause__!r}). {_WHAT_IT_IS}"
        ) from error
    if manifest is None:
        raise ConfigError(f"{folder}: it holds no {MANIFEST}. {_WHAT_IT_IS}")
    return manifest


def _columns(folder: Path, manifest: Manifest) -> dict[str, list[Any]]:
    """Columns by name, the last row of each point, in the order of the points."""
    path = folder / RESULTS
    needed = ("point", *_TEXTS, *(f"param.{p.name}" for p in manifest.parameters), *_NUMBERS)
    rows: dict[int, Mapping[str, Any]] = {}
    if path.is_file():
        rows = {row["point"]: row for row in _parquet_rows(path, needed)}
    # The table is written now and then, the journal at every flight: what is newer stands there.
    for row in read_journal(folder):
        if all(name in row for name in needed):
            rows[row["point"]] = row
    if not rows and not path.is_file() and not (folder / JOURNAL).is_file():
        raise ConfigError(f"{path}: it is missing, and {JOURNAL} too. {_WHAT_IT_IS}")
    return {name: [rows[point][name] for point in sorted(rows)] for name in needed}


def _parquet_rows(path: Path, needed: tuple[str, ...]) -> list[dict[str, Any]]:
    import pyarrow.parquet as parquet

    try:
        table = parquet.read_table(path, use_threads=False)
    except Exception as error:  # pyarrow's own kinds, by what it is that is damaged
        raise ConfigError(f"{path}: no readable Parquet file ({error}). {_WHAT_IT_IS}") from error
    missing = [name for name in needed if name not in table.column_names]
    if missing:
        raise ConfigError(
            f"{path}: not a campaign's table of results: it has no column "
            f"{', '.join(missing)}. {_WHAT_IT_IS}"
        )
    rows: list[dict[str, Any]] = table.select(list(needed)).to_pylist()
    for row in rows:
        _check_row(path, row)
    return rows


def _check_row(path: Path, row: Mapping[str, Any]) -> None:
    fits = isinstance(row["point"], int) and all(
        isinstance(row[name], str | None) for name in _TEXTS
    )
    if not fits or not all(isinstance(row[name], float | int | None) for name in _NUMBERS):
        raise ConfigError(
            f"{path}: not a campaign's table of results: a column is of another type. {_WHAT_IT_IS}"
        )


def _flights(columns: Mapping[str, list[Any]], parameters: tuple[Parameter, ...]) -> Flights:
    values: dict[str, Column] = {}
    for parameter in parameters:
        column = columns[f"param.{parameter.name}"]
        if parameter.kind == "number":
            values[parameter.name] = _numbers(column, math.nan)
        else:
            values[parameter.name] = np.array([str(value) for value in column])
    return Flights(
        np.array(columns["point"], dtype=np.int64),
        values,
        np.array([value or "" for value in columns["outcome"]], dtype=str),
        np.array([value or "" for value in columns["note"]], dtype=str),
        _numbers(columns["mean_error_m"], math.inf),
        _numbers(columns["max_error_m"], math.inf),
        _numbers(columns["flown_s"], math.nan),
        _numbers(columns["scored_s"], math.nan),
    )


def _numbers(column: list[Any], unknown: float) -> Array:
    """Numbers of a column, with `unknown` in the place of what is none."""
    found = np.array([math.nan if value is None else value for value in column], dtype=float)
    found[~np.isfinite(found)] = unknown
    return found
