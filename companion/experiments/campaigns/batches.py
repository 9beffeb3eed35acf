"""A campaign over the batched study: thousands of simplified vehicles at once, in pieces."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from companion.config.yaml_source import ConfigError
from companion.experiments.batched.flying import fly_batch
from companion.experiments.batched.task import BatchTask, check_batch
from companion.experiments.campaigns.parameters import NAMED, PLANT
from companion.experiments.campaigns.plan import Plan, PlannedFlight
from companion.experiments.campaigns.tasks import nominal_task
from companion.experiments.flight_store import FAILED, Summary
from companion.experiments.flight_task import FlightTask
from companion.experiments.progress import Pace, Progress
from companion.experiments.workers import Failure, Workers

_DIGEST_LETTERS = 12
_AT_ONCE = 500
"""A vehicle's last digits depend on those it is flown with: the pieces are the plan's, whatever the
processes and whatever was flown before.  Fewer would lose what flying many at once gains."""


def batch_task_of(plan: Plan, flight: PlannedFlight) -> BatchTask:
    """A flight as a vehicle of a batch."""
    plant = tuple(
        (name, float(value))
        for name, value in flight.values.items()
        if name in PLANT and isinstance(value, int | float)
    )
    return BatchTask(nominal_task(plan, flight), plant)


def batch_key_of(plan: Plan, flight: PlannedFlight) -> str:
    """Of a flight's result.

    Raises:
        ConfigError: a file that it names can't be used.
    """
    return _key(batch_task_of(plan, flight))


def checked_batch(plan: Plan) -> list[tuple[str, BatchTask]]:
    """The tasks of all flights with their keys, each seen to be modelled.

    Raises:
        ConfigError: one is not; the text names the key and the remedy.
    """
    tasks = [batch_task_of(plan, flight) for flight in plan.flights]
    try:
        check_batch(tasks)
        return [(_key(task), task) for task in tasks]
    except ConfigError as error:
        raise ConfigError(f"{plan.path}: {error}") from error


def _key(task: BatchTask) -> str:
    """Of a vehicle's result: of the content of its files, and not of where they lie."""
    said = {name: getattr(task.flight, name) for name in NAMED}
    names: dict[str, Any] = {
        name: Path(value).name
        for name, value in said.items()
        if isinstance(value, str) and not value.startswith("{")
    }
    named = replace(task, flight=replace(task.flight, **names))
    text = f"{named.key} {_content(replace(task.flight, seed=0))}"
    return f"batched-{hashlib.sha256(text.encode()).hexdigest()[:_DIGEST_LETTERS]}"


@lru_cache(maxsize=4096)
def _content(flight: FlightTask) -> str:
    """The same for the same files; reading them for each of a hundred thousand takes minutes."""
    return flight.key


def fly_batches(
    tasks: Mapping[str, BatchTask],
    known: Mapping[str, Summary],
    jobs: int,
    progress: Progress,
    on_flown: Callable[[Summary], None],
) -> None:
    """Fly what is not known.

    A piece of which anything is missing is flown whole, so that its figures are those that it
    would always have; what was known stays.

    Args:
        tasks: by key, in the order of the plan.
        known: figures of what was flown before, by key.
        jobs: how many processes.
        progress: told after each piece, and once before.
        on_flown: told the figures of each flight as they come.
    """
    every = list(tasks.items())
    pieces = [
        piece
        for piece in (every[k : k + _AT_ONCE] for k in range(0, len(every), _AT_ONCE))
        if any(key not in known for key, _ in piece)
    ]
    pace = Pace(sum(key in known for key in tasks), len(tasks), progress)
    pace.tell()

    def on_done(index: int, result: Sequence[Summary] | Failure) -> None:
        piece = pieces[index]
        if isinstance(result, Failure):
            result = [Summary(key, task.flight, FAILED, result.reason) for key, task in piece]
        missing = [summary for summary in result if summary.key not in known]
        for summary in missing:
            on_flown(summary)
        pace.tick(len(missing))

    if not pieces:
        return
    with Workers(_fly_piece, min(jobs, len(pieces))) as workers:
        workers.run(pieces, on_done)


def _fly_piece(piece: Sequence[tuple[str, BatchTask]]) -> list[Summary]:
    """What a worker does."""
    flown = fly_batch([task for _, task in piece])
    return [replace(summary, key=key) for (key, _), summary in zip(piece, flown, strict=True)]
