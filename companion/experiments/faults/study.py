"""Flies the whole table, over several processes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from companion.experiments.faults.flying import Order, Verdict, configured, fly_order
from companion.experiments.progress import Pace, Progress
from companion.experiments.workers import Failure, Workers


@dataclass(frozen=True, slots=True)
class Unflown:
    """A flight that came to nothing."""

    row: str
    autopilot: str
    reason: str


Result = Verdict | Unflown


class StudyInterruptedError(Exception):
    """Ctrl-C."""


def run_study(
    orders: Sequence[Order],
    jobs: int,
    progress: Progress | None = None,
    fly: Callable[[Order], Verdict] | None = None,
) -> list[Result]:
    """Fly.

    Args:
        orders: what to fly.
        jobs: how many processes.
        progress: told after each flight, and once before.
        fly: what a worker does, in place of flying; a function of a module.

    Returns:
        What came of each, in their order.

    Raises:
        ConfigError: one can't be flown as it stands; nothing was flown.
        StudyInterruptedError: Ctrl-C.
    """
    for order in orders:
        configured(order)
    pace = Pace(0, len(orders), progress)
    pace.tell()
    try:
        with Workers(fly or fly_order, min(jobs, max(1, len(orders)))) as workers:
            results = workers.run(orders, lambda *_: pace.tick())
    except KeyboardInterrupt as interrupt:
        raise StudyInterruptedError("interrupted: nothing was written.") from interrupt
    return [
        Unflown(order.row.name, order.autopilot, result.reason)
        if isinstance(result, Failure)
        else result
        for order, result in zip(orders, results, strict=True)
    ]
