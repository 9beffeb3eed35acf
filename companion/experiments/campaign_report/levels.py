"""A parameter cut into levels: its choices, its few numbers, or bins of equally many flights."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from companion.experiments.campaign_report.read import Campaign, Flights, Parameter
from companion.experiments.campaign_report.sensitivity import Codes
from companion.report.flight_data import Array

_AS_THEY_ARE = 12
"""So many different numbers are levels of their own."""
_LEAST_BINS, _MOST_BINS = 4, 16
_WIDE = 50.0
"""Times the lowest number: beyond, as over a logarithmic range, each has digits of its own."""
SEED = "seed"


@dataclass(frozen=True, slots=True)
class Levels:
    """Of one parameter."""

    parameter: Parameter
    codes: Codes
    """Of each flight."""
    labels: tuple[str, ...]
    """Of each level, with the unit, for a person."""
    edges: tuple[float, ...] | None = None
    """Ends of the bins, one more than there are; None where levels are values."""
    values: tuple[float, ...] | None = None
    """Of a number's levels that are no bins."""

    @property
    def count(self) -> int:
        """How many."""
        return len(self.labels)

    def span(self, first: int, last: int) -> str:
        """Neighbouring levels of a number as one, both ends included; for a person."""
        if first == last:
            return self.labels[first]
        if self.values is not None:
            low, high = self.labels[first], self.labels[last]
            over, under = f"{low} or more", f"{high} or less"
        else:
            assert self.edges is not None
            told = plain_numbers(self.edges)
            unit = f"\u00a0{self.parameter.unit}" if self.parameter.unit else ""
            low, high = told[first], f"{told[last + 1]}{unit}"
            over, under = f"more than {low}{unit}", f"less than {high}"
        if last == self.count - 1:
            return over
        return under if first == 0 else f"{low} … {high}"


def bin_count(independent: int) -> int:
    """How many bins that many independent flights bear: with the square root, within bounds."""
    return int(min(_MOST_BINS, max(_LEAST_BINS, round(math.sqrt(independent) / 2.0))))


def levels(parameter: Parameter, flights: Flights, bins: int) -> Levels:
    """Cut a parameter; levels that no flight has are left out.

    Args:
        parameter: number or choice.
        flights: whose values are cut.
        bins: how many, where it must be binned.
    """
    values = flights.values[parameter.name]
    if parameter.kind == "choice" or parameter.name == SEED:
        return _choices(parameter, values)
    distinct, codes = np.unique(values, return_inverse=True)
    if len(distinct) <= _AS_THEY_ARE:
        labels = tuple(number(value, parameter.unit) for value in distinct.tolist())
        return Levels(parameter, codes, labels, values=tuple(distinct.tolist()))
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, bins + 1)))
    codes = np.searchsorted(edges[1:-1], values, side="right")
    used, codes = np.unique(codes, return_inverse=True)
    low = edges[0] if parameter.low is None else min(parameter.low, edges[0])
    high = edges[-1] if parameter.high is None else max(parameter.high, edges[-1])
    ends = (float(low), *(float(edges[k]) for k in used[1:]), float(high))
    told = plain_numbers(ends)
    unit = f"\u00a0{parameter.unit}" if parameter.unit else ""
    labels = tuple(f"{one} … {other}{unit}" for one, other in pairwise(told))
    return Levels(parameter, codes, labels, edges=ends)


def plain_numbers(values: Sequence[float]) -> list[str]:
    """Numbers along an axis with as many digits as tell them apart."""
    low, high = min(values), max(values)
    if not high > low or (low > 0.0 and high > _WIDE * low):
        return [_plain(value) for value in values]
    decimals = max(0, math.ceil(1.5 - math.log10(high - low)))
    return [f"{value:.{decimals}f}".replace("-", "−") for value in values]


def clusters(campaign: Campaign, flights: Flights) -> Codes:
    """Which flights belong together: those of one sampled point.

    A campaign that crosses its sample with controllers or seeds flies each point several times, as
    neighbours in its plan.  Where the folder does not say how often, flights belong together that
    have everything in common but their seed and what was flown at every point.
    """
    each = campaign.manifest.said.get("rows_per_point")
    if isinstance(each, int) and each > 0:
        return _same((flights.point // each)[:, None])
    crossed = {SEED, *_crossed(campaign.manifest.said.get("yaml"))}
    kept = [p for p in campaign.manifest.parameters if p.name not in crossed]
    if not kept:
        return np.arange(len(flights))
    columns = [np.unique(flights.values[p.name], return_inverse=True)[1].ravel() for p in kept]
    return _same(np.stack(columns, axis=1))


def _same(rows: NDArray[Any]) -> Codes:
    found: Codes = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    return found


def _crossed(text: object) -> list[str]:
    """What a campaign's file says is flown at every point."""
    try:
        each = yaml.safe_load(str(text))["each"]
    except (yaml.YAMLError, TypeError, KeyError):
        return []
    return list(each) if isinstance(each, dict) else []


def number(value: float, unit: str | None) -> str:
    """A value with its unit, for a person."""
    return _plain(value) + (f"\u00a0{unit}" if unit else "")


def _plain(value: float) -> str:
    return f"{value:.3g}".replace("-", "−") if abs(value) < 1e5 else f"{value:g}"


def _choices(parameter: Parameter, values: Array) -> Levels:
    told = [number(v, None) if isinstance(v, float) else str(v) for v in values.tolist()]
    given = [number(v, None) if isinstance(v, float) else str(v) for v in parameter.values or ()]
    order = [name for name in dict.fromkeys(given) if name in set(told)]
    order += sorted(set(told) - set(order))
    place = {name: k for k, name in enumerate(order)}
    return Levels(parameter, np.array([place[name] for name in told], dtype=np.intp), tuple(order))
