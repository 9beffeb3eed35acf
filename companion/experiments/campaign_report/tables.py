"""The report's tables: outcomes by group, worst flights, lost flights."""

import itertools
import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from companion.experiments.campaign_report.levels import clusters, number
from companion.experiments.campaign_report.read import Campaign, Flights
from companion.experiments.campaign_report.statistics import (
    Distribution,
    Proportion,
    clustered,
    distribution,
)

GROUPED_BY = ("controller", "wind", "trajectory")
WORST = 10
MOST_GROUPS = 400
_OUT = "again"


@dataclass(frozen=True, slots=True)
class Group:
    """Flights that have some choices in common."""

    by: tuple[str, ...]
    values: tuple[str, ...]
    flights: int
    outcomes: dict[str, int]
    lost: Proportion
    mean_error: Distribution
    max_error: Distribution


@dataclass(frozen=True, slots=True)
class Case:
    """One flight, and how it is flown again."""

    point: int
    outcome: str
    note: str
    lost: bool
    mean_error_m: float
    max_error_m: float
    flown_s: float
    scored_s: float
    values: dict[str, float | str]
    """By parameter."""
    told: dict[str, str]
    """The same for a person, with units."""
    command: str


@dataclass(frozen=True, slots=True)
class Reason:
    """Flights that were lost in the same way."""

    controller: str
    outcome: str
    note: str
    count: int
    points: tuple[int, ...]


def groups(campaign: Campaign) -> tuple[Group, ...]:
    """Every choice by itself, then controller, wind and trajectory together."""
    choices = [p.name for p in campaign.parameters if p.kind == "choice"]
    found = list(_grouped(campaign, ()))
    names = [*(n for n in GROUPED_BY if n in choices), *(n for n in choices if n not in GROUPED_BY)]
    for name in names:
        found += _grouped(campaign, (name,))
    together = tuple(name for name in GROUPED_BY if name in choices)
    for count in range(2, len(together) + 1):
        for by in itertools.combinations(together, count):
            found += _grouped(campaign, by)
    return tuple(found)


def _grouped(campaign: Campaign, by: tuple[str, ...]) -> list[Group]:
    flights = campaign.flights
    if not by:
        return [_group(campaign, (), (), flights)]
    columns = [flights.values[name] for name in by]
    rows = list(zip(*(column.tolist() for column in columns), strict=True))
    given = {p.name: [str(v) for v in p.values or ()] for p in campaign.parameters}
    order = sorted(
        set(rows), key=lambda row: [_place(given[n], v) for n, v in zip(by, row, strict=True)]
    )
    found = []
    for values in order[:MOST_GROUPS]:
        which = np.ones(len(flights), dtype=bool)
        for column, value in zip(columns, values, strict=True):
            which &= column == value
        told = tuple(str(value) for value in values)
        found.append(_group(campaign, by, told, flights.take(which)))
    return found


def _place(order: Sequence[str], value: object) -> tuple[int, str]:
    text = str(value)
    return (order.index(text) if text in order else len(order), text)


def _group(
    campaign: Campaign, by: tuple[str, ...], values: tuple[str, ...], flights: Flights
) -> Group:
    return Group(
        by=by,
        values=values,
        flights=len(flights),
        outcomes=dict(sorted(Counter(flights.outcome.tolist()).items())),
        lost=clustered(flights.lost, clusters(campaign, flights)),
        mean_error=distribution(flights.mean_error_m),
        max_error=distribution(flights.max_error_m),
    )


def worst_tracked(campaign: Campaign, flights: Flights, most: int = WORST) -> list[Case]:
    """Flights of the greatest mean error among those that tracked to the end."""
    tracked = flights.take(~flights.lost)
    order = np.argsort(-tracked.mean_error_m, kind="stable")[:most]
    return cases(campaign, tracked.take(order))


def lost_cases(campaign: Campaign) -> list[Case]:
    """Flights that did not track to the end, the shortest way first."""
    lost = campaign.flights.take(campaign.flights.lost)
    return cases(campaign, lost.take(np.argsort(lost.flown_s, kind="stable")))


def unflown_cases(campaign: Campaign) -> list[Case]:
    """Flights that the program could not fly."""
    return cases(campaign, campaign.unflown)


def cases(campaign: Campaign, flights: Flights) -> list[Case]:
    """Flights one by one, in their order."""
    lost = flights.lost
    return [
        Case(
            point=int(flights.point[k]),
            outcome=str(flights.outcome[k]),
            note=str(flights.note[k]),
            lost=bool(lost[k]),
            mean_error_m=float(flights.mean_error_m[k]),
            max_error_m=float(flights.max_error_m[k]),
            flown_s=float(flights.flown_s[k]),
            scored_s=float(flights.scored_s[k]),
            values={name: column[k].item() for name, column in flights.values.items()},
            told={p.name: _told(p.unit, flights.values[p.name][k]) for p in campaign.parameters},
            command=command(campaign, int(flights.point[k])),
        )
        for k in range(len(flights))
    ]


def command(campaign: Campaign, point: int) -> str:
    """What flies a point again, with its full log: from the folder's own copy of the file."""
    folder = campaign.folder.absolute()
    out = str(folder / _OUT / str(point))
    return shlex.join(["companion", "campaign", str(folder), "--point", str(point), "--out", out])


def reasons(cases_: Sequence[Case]) -> list[Reason]:
    """Lost flights by controller, outcome and what was said of them, the most frequent first."""
    found: dict[tuple[str, str, str], list[int]] = {}
    for case in cases_:
        key = (case.told.get("controller", ""), case.outcome, _kind(case.note))
        found.setdefault(key, []).append(case.point)
    told = [Reason(*key, len(points), tuple(sorted(points))) for key, points in found.items()]
    return sorted(told, key=lambda reason: -reason.count)


def _kind(note: str) -> str:
    """A note without its numbers, so that the same thing at another time is the same thing."""
    first = note.partition("\n")[0]
    words = first.split(" ")
    return " ".join("…" if any(c.isdigit() for c in word) else word for word in words)


def _told(unit: str | None, value: object) -> str:
    return number(value, unit) if isinstance(value, float) else str(value)
