"""The rows of a campaign: one a flight, in a journal as they come, and together as Parquet.

`journal.jsonl` is what counts: a flight is done when its line is there, and a line is there whole
or not at all.  `results.parquet` is made of it now and then, since Parquet can't be appended to.
"""

import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from companion.experiments.campaigns.plan import Parameter, PlannedFlight
from companion.experiments.flight_store import FAILED, Summary, need_pyarrow
from companion.experiments.flight_task import FlightTask
from companion.recording.whole_file import made_whole, write_whole

RESULTS = "results.parquet"
JOURNAL = "journal.jsonl"
_TEXTS = ("outcome", "note")
_ERRORS = ("mean_error_m", "rms_error_m", "max_error_m", "reported_mean_error_m")
_COUNTS = ("fallbacks",)
_FIGURES = (
    *_ERRORS,
    "flown_s",
    "scored_s",
    *_COUNTS,
    "r_max_share",
    "wind_peak_m_s2",
    "tilt_slew_rms_g_s",
    "wall_s",
)
_OF_SUMMARY = tuple(f.name for f in fields(Summary) if f.name not in ("key", "task"))

Row = Mapping[str, Any]
"""A flight: `point`, `key`, `engine`, `param.NAME` for each parameter, outcome and figures.

An error is NaN where the vehicle did not track to the end.  Further figures of a `Summary` may be
there, which are not in the table.
"""


def row_of(
    flight: PlannedFlight, parameters: Sequence[Parameter], engine: str, summary: Summary
) -> Row:
    """The row of a flight."""
    row: dict[str, Any] = {"point": flight.point, "key": summary.key, "engine": engine}
    row |= {f"param.{p.name}": p.cell(flight.values[p.name]) for p in parameters}
    row |= {name: getattr(summary, name) for name in _OF_SUMMARY}
    row |= {name: math.nan for name in _ERRORS if not math.isfinite(row[name])}
    return row


def summary_of(row: Row, task: FlightTask) -> Summary:
    """What a row says of its flight."""
    found = {name: row[name] for name in _OF_SUMMARY}
    found |= {name: math.inf for name in _ERRORS if math.isnan(found[name])}
    return Summary(key=row["key"], task=task, **found)


def is_done(row: Row) -> bool:
    """Whether a flight need not be flown again: a crash is a result, one that failed is none."""
    return bool(row["outcome"] != FAILED)


class Journal:
    """The file of the rows, open to be written; to be used in a `with` statement."""

    def __init__(self, folder: Path) -> None:
        """Begin a journal, or go on with one: what is there stays.

        Raises:
            OSError: it can't be written.
        """
        self._file = os.open(folder / JOURNAL, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
        size = os.fstat(self._file).st_size
        if size and os.pread(self._file, 1, size - 1) != b"\n":
            self._write(b"\n")  # what was torn is a line of its own, and none that says anything

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._file)

    def add(self, row: Row) -> None:
        """Write a row: it outlives this process from now on.

        Raises:
            OSError: it can't be written.
        """
        self._write(_line(row).encode())

    def sync(self) -> None:
        """Let what was written outlive the computer's power, too."""
        os.fsync(self._file)

    def _write(self, left: bytes) -> None:
        while left:
            left = left[os.write(self._file, left) :]


def write_journal(folder: Path, rows: Iterable[Row]) -> None:
    """Put rows in the place of what the journal said.

    Raises:
        OSError: it can't be written.
    """
    write_whole(folder / JOURNAL, "".join(map(_line, rows)))


def read_journal(folder: Path) -> list[Row]:
    """All rows, the last one of each point, in the order of the points; a torn last line is none.

    Raises:
        OSError: the file is there and can't be read.
    """
    try:
        text = (folder / JOURNAL).read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return []
    found: dict[int, Row] = {}
    for line in text.splitlines(keepends=True):
        if line.endswith("\n") and (row := _row(line)) is not None:
            found[row["point"]] = row
    return [found[point] for point in sorted(found)]


def write_results(folder: Path, rows: Iterable[Row], parameters: Sequence[Parameter]) -> None:
    """Write `results.parquet` whole.

    Args:
        folder: of the campaign.
        rows: in any order.
        parameters: of the plan.

    Raises:
        OSError: it can't be written.
        MissingExtraError: pyarrow is not installed.
    """
    import pyarrow.parquet as parquet

    table = results_table(rows, parameters)
    made_whole(folder / RESULTS, lambda path: parquet.write_table(table, path, compression="zstd"))


def results_table(rows: Iterable[Row], parameters: Sequence[Parameter]) -> Any:  # noqa: ANN401
    """Rows as an Arrow table, in the order of the points.

    Args:
        rows: in any order; what is not in the table is passed over.
        parameters: of the plan.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    need_pyarrow()
    import pyarrow as arrow

    kinds = {"number": arrow.float64(), "choice": arrow.string()}
    schema = arrow.schema(
        [
            ("point", arrow.int64()),
            ("key", arrow.string()),
            ("engine", arrow.string()),
            *((f"param.{p.name}", kinds[p.kind]) for p in parameters),
            *((name, arrow.string()) for name in _TEXTS),
            *((name, arrow.int64() if name in _COUNTS else arrow.float64()) for name in _FIGURES),
        ]
    )
    ordered = sorted(rows, key=lambda row: int(row["point"]))
    columns = [[row[name] for row in ordered] for name in schema.names]
    return arrow.Table.from_arrays(
        [arrow.array(c, type=t) for c, t in zip(columns, schema.types, strict=True)],
        schema=schema,
    )


def _line(row: Row) -> str:
    plain = {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in row.items()
    }
    return json.dumps(plain, allow_nan=False) + "\n"


def _row(line: str) -> Row | None:
    """A line's row, with NaN where it says null; None if it is none."""
    try:
        said = json.loads(line)
    except ValueError:
        return None
    if not isinstance(said, dict) or not {"point", "key", *_OF_SUMMARY} <= said.keys():
        return None
    return {name: math.nan if value is None else value for name, value in said.items()}
