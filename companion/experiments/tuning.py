"""Search for the gains of the least cost, by CMA-ES from several starts.

CMA-ES: N. Hansen, "The CMA Evolution Strategy: A Tutorial", https://arxiv.org/abs/1604.00772, by
the library `cma` (https://github.com/CMA-ES/pycma).  The searches of all starts advance together, a
generation each in a round, so that each round can be flown in parallel.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from companion.experiments.flight_store import MissingExtraError
from companion.experiments.tuned_gains import Array, Gains, TunedGain, gains_at, starting_points
from companion.extras import install_extra

_FIRST_STEP = 0.2
"""Standard deviation of the first generation, as a share of each gain's range."""
_POPULATION = 10


@dataclass(frozen=True, slots=True)
class Evaluation:
    """What a set of gains is worth."""

    cost_m: float
    """Finite always."""
    outcome: str = ""
    note: str = ""


@dataclass(frozen=True, slots=True)
class Trial:
    """A set of gains that was evaluated."""

    number: int
    """From 1, over all starts."""
    start: str
    generation: int
    """From 1."""
    gains: Gains
    evaluation: Evaluation


@dataclass(frozen=True, slots=True)
class StartResult:
    """Where the search from one start came to."""

    name: str
    first_cost_m: float
    """Of the start itself."""
    best: Trial
    evaluations: int


@dataclass(frozen=True, slots=True)
class TuningResult:
    """The best that was found."""

    best: Trial
    starts: tuple[StartResult, ...]


Evaluate = Callable[[Sequence[Gains]], Sequence[Evaluation]]
"""Gives the worth of each of several sets of gains."""


def tune(
    table: Sequence[TunedGain],
    evaluate: Evaluate,
    *,
    budget: int,
    starts: int,
    seed: int,
    on_trial: Callable[[Trial], None] = lambda _: None,
    first: Array | None = None,
) -> TuningResult:
    """Search until the budget is spent; the same arguments give the same result.

    Args:
        table: the gains to search.
        evaluate: their worth.
        budget: how many evaluations in all; the starts share it equally.
        starts: how many starts.
        seed: of the search.
        on_trial: told each trial, in the order of their numbers.
        first: the first start, in place of the table's gentle one.

    Raises:
        ValueError: the budget has not one evaluation for each start.
        MissingExtraError: the library `cma` is not installed.
    """
    if starts < 1 or budget < starts:
        raise ValueError(f"a budget of {budget} is too small for {starts} starts")
    streams = np.random.SeedSequence(seed).spawn(starts + 1)
    points = starting_points(table, starts, np.random.default_rng(streams[-1]))
    if first is not None:
        points[0] = ("as it stands", first)
    shares = [budget // starts + (k < budget % starts) for k in range(starts)]
    searches = [
        _Search(name, _strategy(point, stream), share)
        for (name, point), stream, share in zip(points, streams, shares, strict=False)
    ]
    number = 0
    while any(search.left for search in searches):
        asked = [(search, search.ask()) for search in searches if search.left]
        gains = [gains_at(table, point) for _, batch in asked for point in batch]
        worth = iter(zip(gains, evaluate(gains), strict=True))
        for search, batch in asked:
            costs = []
            for _ in batch:
                candidate, evaluation = next(worth)
                number += 1
                trial = Trial(number, search.name, search.generation, candidate, evaluation)
                costs.append(search.take(trial))
                on_trial(trial)
            search.tell(batch, costs)
    results = tuple(search.result() for search in searches)
    best = min((result.best for result in results), key=lambda trial: trial.evaluation.cost_m)
    return TuningResult(best, results)


@dataclass(slots=True)
class _Search:
    """The search from one start."""

    name: str
    strategy: Any
    left: int
    """Evaluations that it may still spend."""
    generation: int = 0
    trials: list[Trial] = field(default_factory=list)

    def ask(self) -> list[Array]:
        """The next generation, or as much of it as may be spent."""
        self.generation += 1
        points = self.strategy.ask()[: self.left]
        self.left -= len(points)
        return list(points)

    def take(self, trial: Trial) -> float:
        self.trials.append(trial)
        cost = trial.evaluation.cost_m
        if not math.isfinite(cost):
            raise ValueError(f"a cost must be finite, not {cost}")
        return cost

    def tell(self, points: list[Array], costs: list[float]) -> None:
        if len(points) == self.strategy.popsize:  # what is cut short by the budget is the last
            self.strategy.tell(points, costs)

    def result(self) -> StartResult:
        best = min(self.trials, key=lambda trial: trial.evaluation.cost_m)
        return StartResult(self.name, self.trials[0].evaluation.cost_m, best, len(self.trials))


def _strategy(start: Array, stream: np.random.SeedSequence) -> Any:  # noqa: ANN401 - no types
    """A CMA-ES over the unit cube whose first candidate is the start itself."""
    try:
        import cma
    except ImportError as error:
        raise MissingExtraError(
            f"The search for gains needs cma, which is missing: {install_extra('study')}"
        ) from error
    random = np.random.default_rng(stream)
    options = {
        "bounds": [0.0, 1.0],
        "popsize": _POPULATION,
        "randn": lambda count, size: random.standard_normal((count, size)),
        "seed": math.nan,  # numpy's global generator is left alone
        "verbose": -9,
        "verb_log": 0,
    }
    strategy = cma.CMAEvolutionStrategy(start, _FIRST_STEP, options)
    strategy.inject([start], force=True)
    return strategy
