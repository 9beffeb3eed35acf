"""Flies a campaign: what is there is kept, what is missing is flown, what comes is written."""

import errno
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from companion.config.yaml_source import ConfigError
from companion.experiments.campaign import CampaignInterruptedError, Crew, Job, run_campaign
from companion.experiments.campaigns.cluster import ClusterLostError, DaskCrew
from companion.experiments.campaigns.folder import (
    PLANTS,
    owned,
    refuse_others,
    rows_before,
    set_aside,
)
from companion.experiments.campaigns.manifest import write_manifest
from companion.experiments.campaigns.parcel import Flown, Parcel
from companion.experiments.campaigns.plan import Plan, PlannedFlight
from companion.experiments.campaigns.results import (
    JOURNAL,
    RESULTS,
    Journal,
    Row,
    row_of,
    summary_of,
    write_results,
)
from companion.experiments.campaigns.tasks import checked_tasks
from companion.experiments.flight_store import FAILED, Summary, need_pyarrow
from companion.experiments.flight_task import FlightTask
from companion.experiments.progress import ProgressDisplay

_WRITE_EVERY_S = 5.0
_WRITING_SHARE = 0.02
"""Of the time, at most, for writing `results.parquet` again and again."""


@dataclass(frozen=True, slots=True)
class Order:
    """A campaign as it is asked for."""

    plan: Plan
    folder: Path
    jobs: int
    command: str
    """That makes it again, and goes on with it with ``--resume``."""
    scheduler: str | None = None
    resume: bool = False
    anew: bool = False
    """Whether what other code flew is flown again."""


def fly_campaign(
    order: Order,
    display: ProgressDisplay,
    fly: Callable[[Job], Summary] | None = None,
    fly_there: Callable[[Parcel], Flown] | None = None,
) -> list[Row]:
    """Fly what is missing of a campaign.

    Args:
        order: what is asked for.
        display: shows how far it is.
        fly: what a worker does, in place of flying; a function of a module.
        fly_there: the same for a worker of a cluster.

    Returns:
        The rows of all flights, in the order of the plan.

    Raises:
        ConfigError: it can't be flown as it stands; nothing was flown, and nothing is changed.
        MissingExtraError: a library is not installed.
        CampaignInterruptedError: Ctrl-C, the cluster is gone, or the folder can't be written any
            more; the text says how to go on.
        OSError: the folder can't be written.
    """
    need_pyarrow()
    plan, folder = order.plan, order.folder
    with owned(folder), ExitStack() as stack:
        before = rows_before(folder, plan, resume=order.resume)
        engine = (
            _batches(order, display)
            if plan.config.engine == "batched"
            else _flights(order, display, fly, fly_there)
        )
        by_key = _by_key(plan.flights, engine.tasks)
        known = {
            row["key"]: summary_of(row, by_key[row["key"]][1])
            for row in before
            if row["key"] in by_key
        }
        others = {row["key"] for row in before}.difference(by_key)
        if others and not order.anew:
            refuse_others(folder, len(others))
        if len(known) < len(by_key):
            # Nothing in the folder is touched before it is known that anything can be flown.
            stack.enter_context(engine.ready)
        rows = [row for key, s in known.items() for row in _rows(plan, by_key[key][0], s)]
        there = {row["point"] for row in before if row["key"] in by_key}
        with _telling_where(folder):
            if others:
                kept = set_aside(folder, before, others)
                display.say(
                    f"{len(others)} flights in {folder} were flown by other code or with other "
                    f"files, and are flown again; {kept} has the campaign as it was."
                )
            write_manifest(folder, plan, order.command)
            journal = stack.enter_context(Journal(folder))
            for row in rows:
                if row["point"] not in there:  # another point of the same flight
                    journal.add(row)
        keeper = _Keeper(plan, folder, journal, rows, display)
        try:
            engine.fly(known, lambda s: keeper.take(_rows(plan, by_key[s.key][0], s)))
            keeper.write()
        except (KeyboardInterrupt, CampaignInterruptedError, ClusterLostError, OSError) as error:
            keeper.write_if_possible()
            raise CampaignInterruptedError(
                f"{_why(error, folder)}: {keeper.done} of {len(plan.flights)} flights are kept in "
                f"{folder}. {_remedy(error)}: {order.command} --resume"
            ) from error
        return keeper.in_order()


@contextmanager
def _telling_where(folder: Path) -> Iterator[None]:
    """Let what the system says of a full disk name the folder, which it does not by itself.

    Raises:
        OSError: it can't be written.
    """
    try:
        yield
    except OSError as error:
        if error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror, str(folder)) from error


def _why(error: BaseException, folder: Path) -> str:
    """What ended a campaign."""
    if isinstance(error, ClusterLostError):
        return str(error)
    if isinstance(error, OSError):
        return f"{error.filename or folder} can't be written ({error.strerror or error})"
    return "interrupted"


def _remedy(error: BaseException) -> str:
    if not isinstance(error, OSError):
        return "Go on with"
    full = error.errno in (errno.ENOSPC, errno.EDQUOT)
    return f"{'Make room' if full else 'Mend that'}, and go on with"


@dataclass(frozen=True, slots=True)
class _Engine:
    """How a campaign's flights are flown."""

    tasks: Sequence[tuple[str, FlightTask]]
    """By the plan, each with its key."""
    fly: Callable[[Mapping[str, Summary], Callable[[Summary], None]], object]
    """Flies what is not known, and tells what comes."""
    ready: AbstractContextManager[object] = field(default_factory=nullcontext)
    """Entered before anything is flown, and before anything is written."""


def _flights(
    order: Order,
    display: ProgressDisplay,
    fly: Callable[[Job], Summary] | None,
    fly_there: Callable[[Parcel], Flown] | None,
) -> _Engine:
    """Each by itself, through the whole program.

    Raises:
        ConfigError: one can't be flown.
    """
    tasks = checked_tasks(order.plan, order.folder / PLANTS)
    crew = None if order.scheduler is None else DaskCrew(order.scheduler, display.say, fly_there)

    def go(known: Mapping[str, Summary], on_flown: Callable[[Summary], None]) -> None:
        run_campaign(
            list(dict(tasks).values()),
            order.folder,
            order.jobs,
            display,
            fly,
            keep=order.plan.config.keep == "flights",
            known=known,
            on_flown=on_flown,
            crew=None if crew is None else nullcontext[Crew](crew),
        )

    return _Engine(tasks, go, crew or nullcontext())


def _batches(order: Order, display: ProgressDisplay) -> _Engine:
    """Many simplified vehicles at once.

    Raises:
        ConfigError: one can't be flown so, or not there.
    """
    from companion.experiments.campaigns.batches import checked_batch, fly_batches

    if order.scheduler is not None:
        raise ConfigError(
            "--scheduler is for engine: flights; batches are flown here. Leave it out."
        )
    tasks = checked_batch(order.plan)
    return _Engine(
        [(key, task.flight) for key, task in tasks],
        lambda known, on_flown: fly_batches(dict(tasks), known, order.jobs, display, on_flown),
    )


class _Keeper:
    """Writes rows as they come."""

    def __init__(
        self,
        plan: Plan,
        folder: Path,
        journal: Journal,
        rows: Iterable[Row],
        display: ProgressDisplay,
    ) -> None:
        self._plan = plan
        self._folder = folder
        self._journal = journal
        self._rows = {row["point"]: row for row in rows}
        self._outcomes = Counter(row["outcome"] for row in self._rows.values())
        self._display = display
        self._due_s = time.monotonic()
        self._told_trouble = False
        self._tell()

    @property
    def done(self) -> int:
        """How many flights need not be flown again."""
        return sum(self._outcomes.values()) - self._outcomes[FAILED]

    def take(self, rows: Sequence[Row]) -> None:
        """Keep the rows of a flight; now and then the whole table is written."""
        for row in rows:
            self._journal.add(row)
            self._rows[row["point"]] = row
            self._outcomes[row["outcome"]] += 1
        self._tell()
        if time.monotonic() >= self._due_s:
            self.write_if_possible()

    def write(self) -> None:
        """Write the table of all rows so far.

        Raises:
            OSError: it can't be written.
        """
        self._journal.sync()
        write_results(self._folder, self._rows.values(), self._plan.parameters)

    def write_if_possible(self) -> None:
        """Write the table, or say that it can't be: the journal has all that stands in it."""
        started = time.monotonic()
        try:
            self.write()
        except OSError as error:
            if not self._told_trouble:
                self._display.say(
                    f"{self._folder / RESULTS} can't be written ({error.strerror or error}); "
                    f"{JOURNAL} has the rows"
                )
            self._told_trouble = True
        ended = time.monotonic()
        self._due_s = ended + max(_WRITE_EVERY_S, (ended - started) / _WRITING_SHARE)

    def in_order(self) -> list[Row]:
        """All rows, in the order of the plan."""
        return [self._rows[point] for point in sorted(self._rows)]

    def _tell(self) -> None:
        counts = self._outcomes.most_common()
        self._display.note(", ".join(f"{count} {outcome}" for outcome, count in counts if count))


def _by_key(
    flights: Sequence[PlannedFlight], tasks: Sequence[tuple[str, FlightTask]]
) -> dict[str, tuple[list[PlannedFlight], FlightTask]]:
    """The flights of the plan by key; those that are the same have one."""
    found: dict[str, tuple[list[PlannedFlight], FlightTask]] = {}
    for flight, (key, task) in zip(flights, tasks, strict=True):
        found.setdefault(key, ([], task))[0].append(flight)
    return found


def _rows(plan: Plan, flights: Sequence[PlannedFlight], summary: Summary) -> list[Row]:
    return [row_of(flight, plan.parameters, plan.config.engine, summary) for flight in flights]
