"""Many simulated flights over the processors, each kept as it ends, so that a study resumes."""

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from companion.experiments.flight_store import (
    FAILED,
    Summary,
    flight_path,
    need_pyarrow,
    read_summary,
    summarise,
    write_flight,
)
from companion.experiments.flight_task import FlightTask
from companion.experiments.fly_task import fly_task
from companion.experiments.progress import Pace, Progress
from companion.experiments.workers import Failure, Workers


class CampaignInterruptedError(Exception):
    """Ctrl-C; the text says what is done and how to go on."""


@dataclass(frozen=True, slots=True)
class Job:
    """A task on its way to a worker."""

    task: FlightTask
    key: str
    folder: Path
    keep: bool = True
    """Whether the flight's data are kept, or its figures alone."""


class Crew(Protocol):
    """Whoever flies: processes here, or a cluster."""

    def run(
        self, items: Sequence[Job], on_done: Callable[[int, Summary | Failure], None]
    ) -> object:
        """Fly all; tell the index and the result of each as it ends."""


def run_campaign(
    tasks: Sequence[FlightTask],
    folder: Path,
    jobs: int,
    progress: Progress | None = None,
    fly: Callable[[Job], Summary] | None = None,
    *,
    keep: bool = True,
    known: Mapping[str, Summary] | None = None,
    on_flown: Callable[[Summary], None] | None = None,
    crew: AbstractContextManager[Crew] | None = None,
) -> dict[str, Summary]:
    """Fly tasks that have not been flown before.

    Flights are kept in `folder/flights/KEY.parquet`.  What is there and can be read is not flown
    again.  A flight that raises, or whose process died each of three times, has the outcome
    "failed" and the reason as its note, and no file.

    Args:
        tasks: what to fly; a key that comes twice is flown once.
        folder: of the campaign; made if it is not there.
        jobs: how many processes.
        progress: told after each flight, and once before.
        fly: what a worker does, in place of flying; a function of a module.
        keep: whether the flights' data are kept as files.
        known: figures of flights that were flown before, by key, whether their files are there
            or not.
        on_flown: told the figures of each flight that was not in `known`, as they come.
        crew: flies in place of processes of this computer.

    Returns:
        Figures by key, in the order of the tasks.

    Raises:
        ConfigError: a task can't be flown as it stands; nothing was flown.
        MissingExtraError: pyarrow is not installed.
        CampaignInterruptedError: Ctrl-C.
        OSError: the folder can't be written.
    """
    need_pyarrow()
    jobs_by_key = {t.key: Job(t, t.key, folder, keep) for t in tasks}
    results: dict[str, Summary] = {}
    tell = on_flown or (lambda _: None)
    if keep:
        (folder / "flights").mkdir(parents=True, exist_ok=True)
    for key, job in jobs_by_key.items():
        if known is not None and key in known:
            results[key] = known[key]
        elif (summary := _kept(job)) is not None:
            results[key] = summary
            tell(summary)
    missing = [job for key, job in jobs_by_key.items() if key not in results]
    pace = Pace(len(results), len(jobs_by_key), progress)
    pace.tell()

    def on_done(index: int, result: Summary | Failure) -> None:
        job = missing[index]
        if isinstance(result, Failure):
            result = Summary(job.key, job.task, FAILED, result.reason)
        results[job.key] = result
        tell(result)
        pace.tick()

    if missing:
        local = Workers(fly or fly_and_keep, min(jobs, len(missing)))
        try:
            with crew or local as flying:
                flying.run(missing, on_done)
        except KeyboardInterrupt as interrupt:
            kept = sum(summary.outcome != FAILED for summary in results.values())
            raise CampaignInterruptedError(
                f"interrupted: {kept} of {len(jobs_by_key)} flights are kept in {folder}. "
                "The same command with the same folder goes on from there."
            ) from interrupt
        finally:
            _sweep(folder)
    return {key: results[key] for key in jobs_by_key}


def fly_and_keep(job: Job) -> Summary:
    """What a worker does: fly, write the file if it is to be kept, give the figures."""
    table = fly_task(job.task)
    if job.keep:
        write_flight(flight_path(job.folder, job.key), job.key, table)
    return summarise(job.key, table)


def _kept(job: Job) -> Summary | None:
    """The figures of a flight that was flown before; None if it was not, or can't be read.

    They are those of the task that is asked for, which may name its files by other paths.
    """
    path = flight_path(job.folder, job.key)
    try:
        return replace(read_summary(path), task=job.task)
    except (OSError, ValueError):
        return None


def _sweep(folder: Path) -> None:
    """Take away what workers that died or were stopped left unfinished, now or in another run."""
    for path in (folder / "flights").glob(".*.parquet.*"):
        if not _lives(path.suffix.removeprefix(".")):
            path.unlink(missing_ok=True)


def _lives(pid: str) -> bool:
    """Whether the process that writes a file is still there: another campaign of this folder's."""
    try:
        os.kill(int(pid), 0)
    except (ValueError, ProcessLookupError):
        return False
    except PermissionError:
        return True
    return True
