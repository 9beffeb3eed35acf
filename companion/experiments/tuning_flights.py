"""The cost of a controller's gains: the mean tracking error on the worst of a few vehicles.

Gains that are best on one vehicle alone stand at the brink of instability: a vehicle whose attitude
lags a quarter more is flown with the same gains, and the larger error counts.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from companion.experiments.flight_task import FlightTask
from companion.experiments.fly_task import fly_task
from companion.experiments.tuned_gains import Gains, as_settings
from companion.experiments.tuning import Evaluation
from companion.experiments.workers import Failure, Workers

_WORST_ERROR_M = 10.0
"""A flight that was flown to its end costs no more than this, one that was lost no less."""
_UNFLYABLE_M = 3.0 * _WORST_ERROR_M
"""Cost of gains that no flight could be begun with."""


def flight_cost(task: FlightTask) -> Evaluation:
    """What a worker does: the mean true error, m, of a flight; the earlier lost, the more."""
    table = fly_task(task)
    if table.mean_error_m < float("inf"):
        return Evaluation(min(table.mean_error_m, _WORST_ERROR_M), table.outcome, table.note)
    missed = 1.0 - table.flown_s / table.scored_s if table.scored_s > 0.0 else 1.0
    return Evaluation(_WORST_ERROR_M * (1.0 + missed), table.outcome, table.note)


@dataclass(frozen=True, slots=True)
class FlownCosts:
    """Evaluates sets of gains by flights over several processes."""

    workers: "Workers[FlightTask, Evaluation]"
    """Of `flight_cost`."""
    tasks: tuple[FlightTask, ...]
    """The flights of each set, but for the gains."""
    on_flown: Callable[[Evaluation], None]
    """Told after each flight, in the order of completion."""

    def __call__(self, batch: Sequence[Gains]) -> list[Evaluation]:
        """Fly each set of gains on each vehicle; the worst flight is what a set is worth."""
        tasks = [
            replace(task, settings=(*task.settings, *as_settings(gains)))
            for gains in batch
            for task in self.tasks
        ]
        results = self.workers.run(tasks, lambda _, result: self.on_flown(_judged(result)))
        judged = [_judged(result) for result in results]
        each = len(self.tasks)
        return [
            max(judged[k : k + each], key=lambda evaluation: evaluation.cost_m)
            for k in range(0, len(judged), each)
        ]


def _judged(result: Evaluation | Failure) -> Evaluation:
    if isinstance(result, Failure):
        return Evaluation(_UNFLYABLE_M, "failed", result.reason)
    return result
