"""What ``companion export`` does: a flight's logs in the form that another program wants."""

import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.status import Status

from companion.export.csv_files import csv_tables, write_dictionary
from companion.export.errors import ExportError
from companion.export.foxglove import write_foxglove
from companion.export.packet_tables import write_packet_tables
from companion.export.parquet import parquet_tables
from companion.export.record_tables import write_record_tables
from companion.export.rerun import write_rerun
from companion.export.source import Tell, survey
from companion.export.tables import Table
from companion.recording.flight_files import FlightFiles, flight_files
from companion.recording.flight_log import RECOVERED
from companion.recording.whole_file import made_whole
from companion.report.consoles import plain_console

FORMATS = {
    "parquet": "a folder of Parquet tables: pandas, polars, DuckDB, MATLAB",
    "csv": "the same tables as CSV",
    "foxglove": "foxglove.mcap, which Foxglove draws in three dimensions",
    "rerun": "flight.rrd, for the rerun viewer",
}
"""What `--to` takes, and what it makes."""

_NO_ULOG = (
    "ULog is not offered: no maintained library writes a new ULog (pyulog writes back what it has "
    "read). PlotJuggler opens flight.mcap as it is"
)
_LINE_EVERY_S = 30.0


@dataclass(frozen=True, slots=True)
class ExportRequest:
    """The options of the command line."""

    flight: Path
    """A flight's folder, or a log in it."""
    to: str = "parquet"
    out: Path | None = None
    """Where to: for tables their folder, else the folder of the file."""


@dataclass(frozen=True, slots=True)
class Exported:
    """What was written."""

    path: Path
    what: str
    """In words, with numbers."""
    note: str = ""
    """What was left out; empty: nothing."""


def run_export(request: ExportRequest) -> Exported:
    """Export a flight and tell what was written.

    Raises:
        ExportError: nothing was written; the text says why.
    """
    if request.to not in FORMATS:
        said = f"--to {request.to}: there are {', '.join(FORMATS)}."
        raise ExportError(f"{said} {_NO_ULOG}." if request.to == "ulog" else said)
    files = flight_files(request.flight)
    target = _target(request, files.folder)
    try:
        with _progress() as tell:
            done = (
                _export_tables(request.to, files, target, tell)
                if request.to in ("parquet", "csv")
                else _export_file(request.to, files, target, tell)
            )
    except OSError as error:
        raise ExportError(
            f"{target} cannot be written: {error.strerror or error}. Choose another place with "
            "--out."
        ) from error
    except (KeyError, TypeError, ValueError) as error:
        raise ExportError(
            f"{files.mcap}: its records are not those of a flight of this version "
            f"({type(error).__name__}: {error}). Export it with the version that flew it."
        ) from error
    console = plain_console(sys.stdout)
    for read in (files.mcap, files.tlog):
        if read is not None and RECOVERED in read.name:
            console.print(f"read: {read}, which was recovered", markup=False, soft_wrap=True)
    console.print(f"written: {done.path}: {done.what}", markup=False, soft_wrap=True)
    if done.note:
        console.print(f"  {done.note}", markup=False, soft_wrap=True)
    return done


def _target(request: ExportRequest, folder: Path) -> Path:
    """What is to be written; it is not there yet.

    Raises:
        ExportError: it is there.
    """
    if request.to in ("parquet", "csv"):
        target = request.out or folder / request.to
        taken = target.exists() and not (target.is_dir() and not any(target.iterdir()))
    else:
        name = "foxglove.mcap" if request.to == "foxglove" else "flight.rrd"
        target = (request.out or folder) / name
        taken = target.exists()
    if taken:
        raise ExportError(
            f"{target} is there already and is not written over. Choose another place with --out."
        )
    return target


def _export_tables(kind: str, files: FlightFiles, target: Path, tell: Tell) -> Exported:
    """Write tables to a folder that appears when all are whole."""
    found = survey(files, tell)
    target.parent.mkdir(parents=True, exist_ok=True)
    # Where the folder is there, it stays the one that others stand in.
    there = target.is_dir()
    unfinished = target / ".unfinished" if there else target.with_name(f".unfinished.{target.name}")
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir()
    try:
        if kind == "parquet":
            said = {"log_time_0_us": str(files.base_us), "flight": files.folder.resolve().name}
            begin = parquet_tables(unfinished, said)
        else:
            begin = csv_tables(unfinished)
        tables = write_record_tables(files, found, begin, tell)
        messages, unknown = write_packet_tables(files, begin, tell)
        tables += messages
        if kind == "csv":
            write_dictionary(unfinished, [table for table, _ in tables])
        if there:
            for made in unfinished.iterdir():
                made.rename(target / made.name)
            unfinished.rmdir()
        else:
            unfinished.replace(target)
    except BaseException:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise
    return Exported(target, _counted(tables, target), _left_out(files, unknown))


def _export_file(kind: str, files: FlightFiles, target: Path, tell: Tell) -> Exported:
    """Write one file that appears when it is whole."""
    write: Callable[[FlightFiles, Path, Tell], object] = (
        write_foxglove if kind == "foxglove" else write_rerun
    )
    made_whole(target, lambda unfinished: write(files, unfinished, tell))
    return Exported(target, _megabytes(target.stat().st_size), _left_out(files, {}))


def _counted(tables: list[tuple[Table, int]], target: Path) -> str:
    rows = sum(count for _, count in tables)
    size = sum(path.stat().st_size for path in target.rglob("*") if path.is_file())
    plural = "" if len(tables) == 1 else "s"
    return f"{len(tables)} table{plural}, {rows:,} rows, {_megabytes(size)}"


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"


def _left_out(files: FlightFiles, unknown: Mapping[int, int]) -> str:
    if files.tlog is None:
        return f"{files.folder} has no flight.tlog: there are no MAVLink messages"
    if unknown:
        listed = ", ".join(f"{count:,} of number {number}" for number, count in unknown.items())
        return f"left out, since the MAVLink dialect does not know the message: {listed}"
    return ""


@contextmanager
def _progress() -> Iterator[Tell]:
    """How far it is: on a terminal a line that changes, elsewhere one now and then."""
    console = plain_console(sys.stderr)
    status: Status | None = None
    due_s = time.monotonic() + _LINE_EVERY_S

    def tell(what: str, done: int, total: int | None) -> None:
        nonlocal due_s
        said = f"{done:,} {what}" if total is None else f"{done:,} of {total:,} {what}"
        if status is not None:
            status.update(said)
        elif time.monotonic() >= due_s:
            due_s = time.monotonic() + _LINE_EVERY_S
            console.print(f"export: {said}", markup=False)

    if console.is_terminal:
        with console.status("reading") as status:
            yield tell
    else:
        yield tell
