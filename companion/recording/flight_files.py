"""The logs of a flight: which files, which clock; read, whoever reads them, by one way."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.exceptions import McapError
from mcap.records import Channel, Metadata
from mcap.stream_reader import StreamReader

from companion.recording.flight_log import MCAP_NAME, TLOG_NAME, recovered_first
from companion.recording.mcap_reader import CLOCK, LogRecord, read_records, told_base_us
from companion.recording.tlog import TlogRecord, read_tlog


class FlightFilesError(Exception):
    """A flight's log can't be used; the text says which, why, and the remedy."""


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
            FlightFilesError: the log cannot be read, or is damaged before its end.
        """
        try:
            yield from read_records(self.mcap)
        except OSError as error:
            raise _unreadable(self.mcap, error) from error
        except McapError as error:
            said = str(error)
            if str(self.mcap) not in said:
                said = f"{self.mcap}: {said or 'no MCAP file'}. Is it a flight's log?"
            raise FlightFilesError(said) from error

    def packets(self) -> Iterator[TlogRecord]:
        """The MAVLink packets, in order, up to where an unfinished log ends; none without a tlog.

        Raises:
            FlightFilesError: the log cannot be read, or is damaged before its end.
        """
        if self.tlog is None:
            return
        try:
            yield from read_tlog(self.tlog)
        except OSError as error:
            raise _unreadable(self.tlog, error) from error
        except ValueError as error:
            raise FlightFilesError(str(error)) from error

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
        FlightFilesError: there is no log of records.
    """
    if not path.exists():
        raise FlightFilesError(
            f"{path} is not there. Name the folder that `companion fly` made for the flight."
        )
    if path.is_file() and path.suffix not in (".mcap", ".tlog"):
        raise FlightFilesError(f"{path} is no log. Name a flight's folder, its .mcap or its .tlog.")
    folder = path if path.is_dir() else path.parent
    mcap = recovered_first(folder / MCAP_NAME) if path.is_dir() or path.suffix != ".mcap" else path
    tlog = recovered_first(folder / TLOG_NAME) if path.is_dir() or path.suffix != ".tlog" else path
    if not mcap.is_file():
        raise FlightFilesError(
            f"{folder} holds no {MCAP_NAME}. Name the folder that `companion fly` made for the "
            "flight."
        )
    return FlightFiles(folder, mcap, tlog if tlog.is_file() else None, _base_us(mcap))


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


def _unreadable(path: Path, error: OSError) -> FlightFilesError:
    return FlightFilesError(f"{path} cannot be read: {error.strerror or error}.")
