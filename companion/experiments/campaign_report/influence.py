"""Which parameter hurts most: the error and the losses against every parameter, ranked."""

import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from companion.experiments.campaign_report.levels import (
    SEED,
    Levels,
    bin_count,
    clusters,
    levels,
)
from companion.experiments.campaign_report.read import Campaign, Flights, Parameter
from companion.experiments.campaign_report.sensitivity import (
    RESAMPLES,
    Codes,
    Correlation,
    Share,
    first_order,
    ranks,
    spearman,
)
from companion.report.flight_data import Array

ALL = "all"
CONTROLLER = "controller"
LEAST_FLIGHTS = 30
"""Below so many conditions nothing is said of shares of the variance."""
LEAST_OF_A_KIND = 5
"""Fewer lost ones, or fewer that are not, say nothing of what loses flights."""
LEAST_A_LEVEL = 2.0
"""Flights a level on average, below which it is the flight rather than the level that is seen."""
_SEED = 20180
_A_PARAMETER = 40
"""Permutations for each parameter: the least p there can be, times the parameters, is 0.025."""
_CHANCE = 0.05
_UNKNOWN = Correlation(math.nan, math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class Influence:
    """One parameter on one figure, over the flights of a group."""

    group: str
    """A controller, or "all"."""
    outcome: str
    """"error": the rank of the mean error, lost flights the worst; "lost": 1 for a lost flight."""
    parameter: str
    kind: str
    levels: int
    flights: int
    share: Share
    p_adjusted: float
    """Holm's, over the parameters of the group."""
    correlation: Correlation
    """Of numbers with the mean error, or with being lost."""
    best: str
    """Level at which the figure is lowest, and the figure there: median error, m, or share lost."""
    best_value: float
    worst: str
    worst_value: float

    @property
    def seen(self) -> bool:
        """Whether chance alone explains it badly."""
        return self.p_adjusted <= _CHANCE


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """All influences, those of a group and a figure in order, and what stood in the way."""

    influences: tuple[Influence, ...]
    remarks: tuple[str, ...]
    groups: tuple[str, ...]

    def of(self, group: str, outcome: str) -> tuple[Influence, ...]:
        """Those of one group on one figure, the strongest first."""
        return tuple(i for i in self.influences if (i.group, i.outcome) == (group, outcome))


def sensitivity(campaign: Campaign) -> Sensitivity:
    """Rank the parameters, over all flights, and for each controller where there are several."""
    flights = campaign.flights
    groups = {ALL: flights}
    if campaign.parameter(CONTROLLER) is not None:
        names = flights.values[CONTROLLER]
        groups |= {name: flights.take(names == name) for name in np.unique(names).tolist()}
    found: list[Influence] = []
    remarks: list[str] = []
    for group, some in groups.items():
        for outcome in ("error", "lost"):
            made, said = _influences(campaign, group, some, outcome)
            found += made
            remarks += said
    return Sensitivity(tuple(found), tuple(dict.fromkeys(remarks)), tuple(groups))


def _influences(
    campaign: Campaign, group: str, flights: Flights, outcome: str
) -> tuple[list[Influence], list[str]]:
    where = "over all flights" if group == ALL else f"for {group}"
    together = clusters(campaign, flights)
    conditions = int(together.max()) + 1 if len(together) else 0
    lost = int(flights.lost.sum())
    if conditions < LEAST_FLIGHTS:
        few = (
            f"Conditions of their own {where}: {conditions}, too few to tell which parameter "
            f"decides. Fly {LEAST_FLIGHTS} at least."
        )
        return [], [few]
    if outcome == "lost" and min(lost, len(flights) - lost) < LEAST_OF_A_KIND:
        if lost == 0:
            return [], []
        few = "lost" if lost < LEAST_OF_A_KIND else "not lost"
        return [], [
            f"Fewer than {LEAST_OF_A_KIND} flights were {few} {where}: too few to tell by what."
        ]
    cuts, remarks = _cuts(campaign.parameters, flights, bin_count(conditions), group)
    figure = flights.lost.astype(float) if outcome == "lost" else flights.mean_error_m
    resamples = max(RESAMPLES, _A_PARAMETER * len(cuts))
    found = [_influence(group, outcome, cut, flights, figure, together, resamples) for cut in cuts]
    adjusted = _holm([one.share.p for one in found])
    found = [replace(one, p_adjusted=p) for one, p in zip(found, adjusted, strict=True)]
    found.sort(key=lambda one: -_or_zero(one.share.value))
    return found, remarks


def _cuts(
    parameters: Sequence[Parameter], flights: Flights, bins: int, group: str
) -> tuple[list[Levels], list[str]]:
    found, remarks = [], []
    for parameter in parameters:
        cut = levels(parameter, flights, bins)
        if cut.count < 2:
            continue
        if len(flights) < LEAST_A_LEVEL * cut.count:
            remarks.append(
                f"{parameter.name} is another one on nearly every flight: what it does is part of "
                "what no parameter explains."
            )
            continue
        found.append(cut)
    return found, remarks


def _influence(
    group: str,
    outcome: str,
    cut: Levels,
    flights: Flights,
    figure: Array,
    together: Codes,
    resamples: int,
) -> Influence:
    name = cut.parameter.name
    words = (_SEED, *(zlib.crc32(word.encode()) for word in (group, outcome, name)))
    share_seed, rank_seed = np.random.SeedSequence(words).spawn(2)
    y = ranks(figure) if outcome == "error" else figure
    is_number = cut.parameter.kind == "number" and name != SEED
    correlation = (
        spearman(flights.values[name], figure, together, rank_seed) if is_number else _UNKNOWN
    )
    of_level = level_values(cut, figure, _mean if outcome == "lost" else _median)
    best, worst = int(np.argmin(of_level)), int(np.argmax(of_level))
    return Influence(
        group=group,
        outcome=outcome,
        parameter=name,
        kind="number" if is_number else "choice",
        levels=cut.count,
        flights=len(flights),
        share=first_order(cut.codes, y, together, share_seed, resamples),
        p_adjusted=math.nan,
        correlation=correlation,
        best=_told(cut, of_level, best),
        best_value=float(of_level[best]),
        worst=_told(cut, of_level, worst),
        worst_value=float(of_level[worst]),
    )


def level_values(cut: Levels, figure: Array, by: Callable[[Array], float]) -> Array:
    """A figure at each level, (levels,)."""
    return np.array([by(figure[cut.codes == level]) for level in range(cut.count)])


def _told(cut: Levels, of_level: Array, place: int) -> str:
    """A level, with those beside it that are as good or as bad where it is a number's."""
    if cut.values is None and cut.edges is None:
        return cut.labels[place]
    first = last = place
    while first > 0 and of_level[first - 1] == of_level[place]:
        first -= 1
    while last < cut.count - 1 and of_level[last + 1] == of_level[place]:
        last += 1
    return cut.span(first, last) if last - first + 1 < cut.count else "any"


def _median(values: Array) -> float:
    return float(np.quantile(values, 0.5, method="inverted_cdf"))


def _mean(values: Array) -> float:
    return float(values.mean())


def _holm(p: Sequence[float]) -> list[float]:
    """Holm's adjustment (1979); NaN stays."""
    known = sorted((value, k) for k, value in enumerate(p) if not math.isnan(value))
    adjusted = [math.nan] * len(p)
    least = 0.0
    for place, (value, k) in enumerate(known):
        least = max(least, min(1.0, (len(known) - place) * value))
        adjusted[k] = least
    return adjusted


def _or_zero(value: float) -> float:
    return 0.0 if math.isnan(value) else value
