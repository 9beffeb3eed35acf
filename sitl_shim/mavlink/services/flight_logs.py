"""The logs that the autopilot writes: one per boot, and a new one after the old were erased."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

from sitl_shim.mavlink.services import dataflash, ulog
from sitl_shim.mavlink.services.file_tree import ListedFile
from sitl_shim.mavlink.services.flight_record import Record, record_of
from sitl_shim.mavlink.services.log_bytes import LogBytes
from sitl_shim.simulation import Simulation

_PERIOD_US = 100_000
_MOST_BYTES = 4_000_000
"""A log that is full ends, as it does on a card that is full."""
_EPOCH_UNIX_S = 1_767_225_600
"""Wall time of every boot, the beginning of 2026."""


@dataclass(frozen=True, slots=True)
class LogFormat:
    """How a flavour writes its logs, and where."""

    header: Callable[[int], bytes]
    """Beginning of a log, for its start in µs since boot."""
    row: Callable[[Record], bytes]
    path: Callable[[int, int], str]
    """Path of a log, from the root, by its number and its start in seconds since boot."""
    first_id: int
    """Id of the first log."""
    starts_us: int
    """Boot time from which the first log is written."""
    opening_text: str
    """What is said then; `{path}` stands for the log's path.  Empty: nothing."""


@dataclass(slots=True)
class FlightLog:
    """One log."""

    id: int
    path: str
    time_utc_s: int
    """When it was begun, Unix time."""
    content: LogBytes = field(default_factory=LogBytes)


def _px4_path(number: int, start_s: int) -> str:
    hours, rest = divmod(start_s, 3600)
    return f"log/2026-01-01/{hours % 24:02d}_{rest // 60:02d}_{rest % 60:02d}.ulg"


def _ardupilot_path(number: int, start_s: int) -> str:
    return f"APM/LOGS/{number:08d}.BIN"


_FORMATS: Mapping[str, LogFormat] = {
    "px4": LogFormat(ulog.header, ulog.row, _px4_path, 0, 2_000_000, "[logger] ./{path}\t"),
    "ardupilot": LogFormat(dataflash.header, dataflash.row, _ardupilot_path, 1, 2_000_000, ""),
}


class FlightLogs:
    """Writes the logs of one vehicle.

    Args:
        sim: of the vehicle.
        flavour: of its autopilot.
    """

    def __init__(self, sim: Simulation, flavour: str) -> None:
        self._sim = sim
        self.format = _FORMATS[flavour]
        self.logs: list[FlightLog] = []
        """The oldest first; the last one is still being written."""
        self.next_us = self.format.starts_us
        """When the next row is due."""
        self._written = 0

    def step(self, now_us: int) -> str | None:
        """Write what is due; returns what is to be said when a log begins."""
        if now_us < self.next_us:
            return None
        self.next_us = now_us + _PERIOD_US
        text = None
        if not self.logs:
            text = self._begin(now_us)
        content = self.logs[-1].content
        if len(content) < _MOST_BYTES:
            content.append(self.format.row(record_of(self._sim)))
        return text

    def erase(self) -> None:
        """Forget all logs; a new one begins at once."""
        self.logs = []

    def files(self) -> dict[str, ListedFile]:
        """The logs by path."""
        return {
            log.path: ListedFile(len(log.content), partial(log.content.read, 0, len(log.content)))
            for log in self.logs
        }

    def _begin(self, now_us: int) -> str | None:
        number = self._written
        self._written += 1
        path = self.format.path(number + 1, now_us // 1_000_000)
        log = FlightLog(
            self.format.first_id + len(self.logs), path, _EPOCH_UNIX_S + now_us // 10**6
        )
        log.content.append(self.format.header(now_us))
        self.logs.append(log)
        return self.format.opening_text.format(path=path) or None
