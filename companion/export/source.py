"""The logs of a flight that are exported: which files, which clock, what is in the records."""

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from mcap.exceptions import McapError
from mcap.records import Channel, Metadata
from mcap.stream_reader import StreamReader

from companion.export.errors import ExportError
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME, recovered_path
from companion.recording.mcap_reader import CLOCK, LogRecord, read_records, told_base_us
from companion.recording.tlog import TlogRecord, read_tlog

_TOLD_EACH = 2000
"""Records between two words about how far it is."""

Tell = Callable[[str, int, int | None], None]
"""Told what is being read or written, how many are done, and of how many (None: not known)."""


class Sighting(NamedTuple):
    """What a field's values look like."""

    kind: str
    """number, integer, boolean, string, json (anything else), or empty: only nulls."""
    width: int
    """Of an array of numbers its greatest length; else 0."""


@dataclass(slots=True)
class Topic:
    """What the records of one topic hold."""

    fields: dict[str, Sighting] = field(default_factory=dict)
    records: int = 0


@dataclass(frozen=True, slots=True)
class Survey:
    """What is in a flight's records, from one reading of them."""

    topics: dict[str, Topic]
    """In the order in which they appear."""
    records: int
    last_s: float
    """Time of the last record; 0 if there is none."""


@dataclass(frozen=True, slots=True)
class FlightFiles:
    """The logs of one flight; of a damaged one that was recovered, what was recovered."""

    folder: Path
    mcap: Path
    tlog: Path | None
    """None if there is none."""
    base_us: int
    """Microseconds since 1970 at the log's time 0."""

    def records(self) -> Iterator[LogRecord]:
        """The controller's records, in order, up to where an unfinished log ends.

        Raises:
            ExportError: the log cannot be read, or is damaged before its end.
        """
        try:
            yield from read_records(self.mcap)
        except OSError as error:
            raise _unreadable(self.mcap, error) from error
        except McapError as error:
            raise ExportError(str(error) or f"{self.mcap} is no MCAP file.") from error

    def packets(self) -> Iterator[TlogRecord]:
        """The MAVLink packets, in order, up to where an unfinished log ends; none without a tlog.

        Raises:
            ExportError: the log cannot be read, or is damaged before its end.
        """
        if self.tlog is None:
            return
        try:
            yield from read_tlog(self.tlog)
        except OSError as error:
            raise _unreadable(self.tlog, error) from error
        except ValueError as error:
            raise ExportError(str(error)) from error

    def log_time_s(self, packet: TlogRecord) -> float:
        """Time of a packet on the records' axis, seconds."""
        return (packet.time_us - self.base_us) * 1e-6

    def log_time_ns(self, record: LogRecord) -> int:
        """Time of a record, nanoseconds since 1970."""
        return self.base_us * 1000 + round(record.time_s * 1e9)


def flight_files(path: Path) -> FlightFiles:
    """The logs of a flight.

    Args:
        path: the flight's folder, or one of the two logs in it.

    Raises:
        ExportError: there is no log of records.
    """
    if not path.exists():
        raise ExportError(
            f"{path} is not there. Name the folder that `companion fly` made for the flight."
        )
    folder = path if path.is_dir() else path.parent
    mcap = _best(folder / MCAP_NAME) if path.is_dir() or path.suffix != ".mcap" else path
    tlog = _best(folder / TLOG_NAME) if path.is_dir() or path.suffix != ".tlog" else path
    if not mcap.is_file():
        raise ExportError(
            f"{folder} holds no {MCAP_NAME}. Name the folder that `companion fly` made for the "
            "flight."
        )
    return FlightFiles(folder, mcap, tlog if tlog.is_file() else None, _base_us(mcap))


def survey(files: FlightFiles, tell: Tell) -> Survey:
    """Read all records once, to know what columns there are.

    Raises:
        ExportError: the log cannot be read.
    """
    topics: dict[str, Topic] = {}
    count = 0
    last_s = 0.0
    for record in files.records():
        topic = topics.setdefault(record.topic, Topic())
        topic.records += 1
        seen = topic.fields
        for name, value in record.values.items():
            seen[name] = _merged(seen.get(name, _NOTHING), _sight(value))
        last_s = max(last_s, record.time_s)
        count += 1
        if count % _TOLD_EACH == 0:
            tell("records read", count, None)
    if not count:
        raise ExportError(f"{files.mcap} holds no records: there is nothing to export.")
    return Survey(topics, count, last_s)


_NOTHING = Sighting("", 0)


def _sight(value: object) -> Sighting:
    if value is None:
        return _NOTHING
    if isinstance(value, bool):
        return Sighting("boolean", 0)
    if isinstance(value, int):
        return Sighting("integer", 0)
    if isinstance(value, float):
        return Sighting("number", 0)
    if isinstance(value, str):
        return Sighting("string", 0)
    if isinstance(value, list) and value and all(_is_number(item) for item in value):
        return Sighting("number", len(value))
    return Sighting("json", 0)


def _is_number(value: Any) -> bool:  # noqa: ANN401 - any value
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _merged(one: Sighting, other: Sighting) -> Sighting:
    """What holds both."""
    if one == other or not other.kind:
        return one
    if not one.kind:
        return other
    if one.width and other.width:
        return Sighting("number", max(one.width, other.width))
    if {one.kind, other.kind} == {"number", "integer"} and not one.width + other.width:
        return Sighting("number", 0)
    return Sighting("json", 0)


def _best(log: Path) -> Path:
    """What was recovered of a log, if somebody did that; else the log."""
    recovered = recovered_path(log)
    return recovered if recovered.is_file() else log


def _base_us(mcap: Path) -> int:
    """Microseconds since 1970 at the log's time 0; 0 if the log does not say it."""
    try:
        with mcap.open("rb") as file:
            for record in StreamReader(file).records:
                told = None
                if isinstance(record, Channel) or (
                    isinstance(record, Metadata) and record.name == CLOCK
                ):
                    told = told_base_us(record.metadata)
                if told is not None:
                    return told
    except OSError as error:
        raise _unreadable(mcap, error) from error
    except (McapError, ValueError, struct.error, EOFError):
        return 0  # whatever is wrong is told by who reads the records
    return 0


def _unreadable(path: Path, error: OSError) -> ExportError:
    return ExportError(f"{path} cannot be read: {error.strerror or error}.")
