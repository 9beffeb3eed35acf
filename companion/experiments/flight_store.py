"""Flights on disk: one Parquet file each, written whole or not at all."""

import io
import json
import math
import os
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from companion.experiments.flight_table import Column, FlightTable
from companion.experiments.flight_task import FlightTask
from companion.extras import install_extra

FAILED = "failed"
"""Outcome of a task that could not be flown: nothing of it is kept, and it is flown again."""

_METADATA = b"companion.flight"
_FIGURES = tuple(
    field.name for field in fields(FlightTable) if field.name not in ("task", "columns")
)
_ENDLESS = ("mean_error_m", "rms_error_m", "max_error_m", "reported_mean_error_m")
_WORDS = ("phase", "plan_status")
_PRECISE = "time_s"
"""The one column that keeps its eight bytes: microseconds of an hour need them."""


class MissingExtraError(Exception):
    """A library of an optional extra is not installed; the text says how to get it."""


@dataclass(frozen=True, slots=True)
class Summary:
    """A flight's figures without its data; fields as in `FlightTable`."""

    key: str
    task: FlightTask
    outcome: str
    note: str
    mean_error_m: float = math.inf
    rms_error_m: float = math.inf
    max_error_m: float = math.inf
    reported_mean_error_m: float = math.inf
    peak_height_error_m: float = math.nan
    reported_peak_height_error_m: float = math.nan
    flown_s: float = math.nan
    scored_s: float = math.nan
    fallbacks: int = 0
    r_max_share: float = 0.0
    wind_peak_m_s2: float = math.nan
    tilt_slew_rms_g_s: float = math.nan
    event: str = ""
    event_s: float = math.nan
    wall_s: float = math.nan


def summarise(key: str, table: FlightTable) -> Summary:
    """The figures of a flight."""
    return Summary(key, table.task, **{name: getattr(table, name) for name in _FIGURES})


def flight_path(folder: Path, key: str) -> Path:
    """Where a flight's file lies in a campaign's folder."""
    return folder / "flights" / f"{key}.parquet"


def flight_bytes(key: str, table: FlightTable) -> bytes:
    """What a flight's file holds.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    arrow, parquet = _pyarrow()
    said: dict[str, Any] = {"key": key, "task": asdict(table.task)}
    said |= {name: _plain(getattr(table, name)) for name in _FIGURES}
    names = list(table.columns)
    arrays = [arrow.array(_lean(name, column)) for name, column in table.columns.items()]
    content = arrow.Table.from_arrays(arrays, names=names).replace_schema_metadata(
        {_METADATA: json.dumps(said, ensure_ascii=False, allow_nan=False).encode()}
    )
    numbers = [field.name for field in content.schema if field.name not in _WORDS]
    sink = io.BytesIO()
    parquet.write_table(
        content,
        sink,
        compression="zstd",
        use_dictionary=[name for name in names if name in _WORDS],
        use_byte_stream_split=[n for n in numbers if content[n].type != arrow.bool_()],
        write_statistics=False,
    )
    return sink.getvalue()


def write_flight(path: Path, key: str, table: FlightTable) -> None:
    """Write a flight; whoever looks sees the whole file or none.

    Raises:
        OSError: it can't be written.
        MissingExtraError: pyarrow is not installed.
    """
    write_flight_bytes(path, flight_bytes(key, table))


def write_flight_bytes(path: Path, content: bytes) -> None:
    """Write what `flight_bytes` gives; whoever looks sees the whole file or none.

    Raises:
        OSError: it can't be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        unfinished.write_bytes(content)
        unfinished.replace(path)
    except BaseException:
        with suppress(OSError):
            unfinished.unlink()
        raise


def read_flight_table(path: Path) -> FlightTable:
    """Read a flight back.

    Raises:
        OSError: the file can't be read.
        ValueError: it is damaged, or no flight of this program.
        MissingExtraError: pyarrow is not installed.
    """
    content = _read(path)
    said = _said(path, content)
    columns: dict[str, Column] = {
        name: content.column(name).to_numpy() for name in content.column_names
    }
    columns |= {
        name: column.astype(str) for name, column in columns.items() if column.dtype == object
    }
    return FlightTable(
        task=said["task"], columns=columns, **{name: said[name] for name in _FIGURES}
    )


def read_summary(path: Path) -> Summary:
    """The figures of a flight's file, all of which is checked to be readable; errors as above."""
    said = _said(path, _read(path))
    return Summary(said["key"], said["task"], **{name: said[name] for name in _FIGURES})


def need_pyarrow() -> None:
    """Fail now rather than after the first flight.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    _pyarrow()


def _pyarrow() -> tuple[ModuleType, ModuleType]:
    try:
        import pyarrow as arrow
        import pyarrow.parquet as parquet
    except ImportError as error:
        raise MissingExtraError(
            "Flights' data are kept as Parquet, for which pyarrow is missing: "
            f"{install_extra('study')}"
        ) from error
    return arrow, parquet


def _read(path: Path) -> Any:  # noqa: ANN401 - pyarrow has no types
    _, parquet = _pyarrow()
    try:
        return parquet.read_table(path, use_threads=False)
    except FileNotFoundError:
        raise
    except Exception as error:  # pyarrow's own kinds, by what it is that is damaged
        raise ValueError(f"{path}: no readable Parquet file: {error}") from error


def _said(path: Path, content: Any) -> dict[str, Any]:  # noqa: ANN401 - pyarrow has no types
    """What the file says of its flight, with the types of a `FlightTable`."""
    try:
        said: dict[str, Any] = json.loads(content.schema.metadata[_METADATA])
        for name in _FIGURES:
            if said[name] is None:
                said[name] = math.inf if name in _ENDLESS else math.nan
        settings = tuple((str(key), str(value)) for key, value in said["task"]["settings"])
        said["task"] = FlightTask(**(said["task"] | {"settings": settings}))
    except (TypeError, KeyError, ValueError) as error:
        raise ValueError(f"{path}: no flight of this program ({error!r})") from error
    return said


def _plain(value: object) -> object:
    """JSON has neither NaN nor infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _lean(name: str, column: Column) -> Column:
    return column.astype(np.float32) if column.dtype == float and name != _PRECISE else column
