"""One flight of a campaign again, with its full log."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from companion.config.yaml_source import ConfigError
from companion.experiments.campaigns.plan import Plan
from companion.experiments.campaigns.results import Row, row_of
from companion.experiments.campaigns.tasks import described, task_of
from companion.experiments.flight_store import summarise
from companion.experiments.flight_task import load_task
from companion.experiments.fly_task import fly_loaded_task
from companion.experiments.memory_log import MemoryLog
from companion.flight.beginning import begin_log, discard_log
from companion.flight.errors import ShimRefusedError
from companion.flight.records import CHANNELS
from companion.recording.flight_log import FlightLog
from companion.report.aftermath import score_and_draw
from companion.trajectories.from_file import TrajectoryFileError


@dataclass(frozen=True, slots=True)
class Again:
    """A point that was flown again."""

    row: Row
    """As in the campaign's table."""
    says: str
    """The point's values, for a person."""
    trouble: str | None
    """What of the log could not be written."""


def fly_point(plan: Plan, point: int, folder: Path) -> Again:
    """Fly a point of a campaign by itself, with its full log.

    The figures are taken as the campaign takes them, in memory: the log's own are rounded to four
    bytes.

    Args:
        plan: of the campaign.
        point: which flight.
        folder: of its log; it must hold none yet.

    Raises:
        ConfigError: there is no such point, or it can't be flown.
        FlightLogError: the folder can't be used.
        OSError: its plant file can't be written.
    """
    if not 0 <= point < len(plan.flights):
        raise ConfigError(
            f"--point {point}: {plan.path} has the points 0 … {len(plan.flights) - 1}."
        )
    flight = plan.flights[point]
    is_new = not folder.exists()
    task = task_of(plan, flight, folder)
    key, loaded = task.key, load_task(task)
    log = begin_log(folder, CHANNELS, lockstep=True)
    both = _Both(log)
    started = time.perf_counter()
    try:
        table, outcome = fly_loaded_task(task, loaded, cast("MemoryLog", both))
    except (TrajectoryFileError, ShimRefusedError) as error:
        log.close()
        discard_log(folder, folder_too=is_new)
        raise ConfigError(f"{plan.path}: point {point} can't be flown: {error}") from error
    finally:
        log.close()
    trouble = log.trouble
    if outcome is None:
        discard_log(folder, folder_too=is_new)
    else:
        _, untold = score_and_draw(loaded.config, outcome, folder, time.perf_counter() - started)
        trouble = trouble or untold
    row = row_of(flight, plan.parameters, "flights", summarise(key, table))
    return Again(row, described(flight.values), trouble)


class _Both:
    """Takes what a flight gives its log, for the files and for the figures."""

    def __init__(self, files: FlightLog) -> None:
        self._files = files
        self._memory = MemoryLog()
        self.folder = files.folder
        self.data = self._memory.data

    def frame_in(self, time_s: float, raw: bytes) -> None:
        """Of a received packet."""
        self._memory.frame_in(time_s, raw)
        self._files.frame_in(time_s, raw)

    def frame_out(self, time_s: float, raw: bytes) -> None:
        """Of a sent packet."""
        self._files.frame_out(time_s, raw)

    def record(self, topic: str, time_s: float, values: Mapping[str, Any]) -> None:
        """Of what a stage says of itself."""
        self._memory.record(topic, time_s, values)
        self._files.record(topic, time_s, values)

    @property
    def trouble(self) -> str | None:
        """What of the files can't be written any more."""
        return self._files.trouble

    def flush_if_due(self, time_s: float) -> None:
        """While nothing comes in."""
        self._files.flush_if_due(time_s)
