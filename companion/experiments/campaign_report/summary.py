"""The report's first words: did it track, where does it break, what hurts most."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from companion.experiments.campaign_report.influence import (
    ALL,
    CONTROLLER,
    Influence,
    Sensitivity,
)
from companion.experiments.campaign_report.levels import Levels, bin_count, clusters, levels
from companion.experiments.campaign_report.read import Campaign, Flights, Parameter
from companion.experiments.campaign_report.sensitivity import Codes
from companion.experiments.campaign_report.statistics import (
    Proportion,
    clustered,
)
from companion.experiments.campaign_report.tables import Group
from companion.report.pages.style import name_of, percent

_MM = 1e3
_LEAST_IN_A_PLACE = 5
_ALL_LOST = "all {} were lost. Fly milder conditions to see where it begins."
_PLACES = 8
"""Bins of a number, where losses are looked for."""


@dataclass(frozen=True, slots=True)
class Summary:
    """Sentences for a person."""

    state: str
    """How much of the plan there is; empty where it is all there."""
    tracked: tuple[str, ...]
    breaks: tuple[str, ...]
    hurts: tuple[str, ...]


def summarise(campaign: Campaign, groups: tuple[Group, ...], found: Sensitivity) -> Summary:
    """Answer the three questions."""
    return Summary(
        state=_state(campaign),
        tracked=_tracked(campaign, groups),
        breaks=_breaks(campaign, found),
        hurts=_hurts(campaign, found),
    )


def _state(campaign: Campaign) -> str:
    said = []
    planned = campaign.manifest.flights
    if campaign.missing:
        said.append(
            f"Not finished: {planned - campaign.missing} of {planned} flights have ended. What is "
            "missing is not a random choice of the plan, so shares and sensitivity may change."
        )
    if len(campaign.unflown):
        count = len(campaign.unflown)
        said.append(
            f"{count} {'flight' if count == 1 else 'flights'} could not be flown by the program "
            "at all and count nowhere; they are listed below."
        )
    return " ".join(said)


def _tracked(campaign: Campaign, groups: tuple[Group, ...]) -> tuple[str, ...]:
    if not len(campaign.flights):
        return ("No flight could be flown.",)
    whole = [group for group in groups if not group.by]
    by_controller = [group for group in groups if group.by == (CONTROLLER,)]
    return tuple(_tracked_sentence(campaign, group) for group in by_controller or whole)


def _tracked_sentence(campaign: Campaign, group: Group) -> str:
    name = group.values[0] if group.values else _controller(campaign)
    kept = group.lost.rest
    counted = f"{kept.count} of {_flights(kept.of)} tracked to the end"
    text = f"{name_of(name)}: {counted}, {share_text(kept)}"
    error = group.mean_error
    if not kept.count:
        return text + "."
    median = "the median flight was lost, the worst that tracked has a mean error of "
    if math.isfinite(error.median):
        median = f"mean error {mm(error.median)} in the median flight, in the worst that tracked "
    return f"{text}; {median}{mm(error.worst_tracked)}."


def _controller(campaign: Campaign) -> str:
    base = campaign.manifest.said.get("base")
    given = campaign.flights.values.get(CONTROLLER)
    if given is not None and len(given):
        return str(given[0])
    return str(base.get(CONTROLLER, "all")) if isinstance(base, dict) else "all"


def _breaks(campaign: Campaign, known: Sensitivity) -> tuple[str, ...]:
    flights = campaign.flights
    lost = int(flights.lost.sum())
    if not len(flights):
        return ()
    overall = clustered(flights.lost, clusters(campaign, flights))
    if not lost:
        none = f"Nothing broke: none of {_flights(overall.of)} was lost, "
        return (none + f"so the true share is at most {percent(overall.high)} (at 95 %).",)
    if lost == overall.of == 1:
        return ("The one flight was lost. Fly milder conditions to see where it begins.",)
    if lost == overall.of:
        return (f"Everywhere: {_ALL_LOST.format(_flights(lost))}",)
    found = [f"{lost} of {_flights(overall.of)} were lost, {share_text(overall)}."]
    for name, some in _by_controller(campaign):
        if some.lost.any():
            found.append(_lost_sentence(known, campaign, name, some))
    return tuple(found)


def _by_controller(campaign: Campaign) -> list[tuple[str, Flights]]:
    flights = campaign.flights
    if campaign.parameter(CONTROLLER) is None:
        return [("", flights)]
    names = flights.values[CONTROLLER]
    return [(name, flights.take(names == name)) for name in dict.fromkeys(names.tolist())]


def _lost_sentence(found: Sensitivity, campaign: Campaign, name: str, flights: Flights) -> str:
    lost = int(flights.lost.sum())
    head = f"{name_of(name)}: {lost} of {len(flights)} lost, " if name else "Of these "
    if lost == len(flights):
        return f"{name_of(name)}: {_ALL_LOST.format(_flights(lost))}"
    known = found.of(name or ALL, "lost")
    if not known:
        return f"{head}too few to tell where more than elsewhere."
    seen = [one.parameter for one in known if one.seen]
    together = clusters(campaign, flights)
    place = _most_lost([p for p in campaign.parameters if p.name in seen], flights, together)
    if place is None:
        return f"{head}no more in one part of the plan than in another that is told from chance."
    where, share = place
    return (
        f"{head}{share.count} of {share.of} at {where} "
        f"({_points(share.low)} … {_points(share.high)} %), {lost - share.count} of "
        f"{len(flights) - share.of} elsewhere."
    )


def _most_lost(
    parameters: Sequence[Parameter], flights: Flights, together: Codes
) -> tuple[str, Proportion] | None:
    """Where the share of losses is highest for sure: by the lower end of its interval.

    A place is a level, or neighbouring levels of a number.  The best of many says nothing by
    itself: some level of some parameter always stands out.  So the parameters are those alone whose
    part in the losses is told from chance.
    """
    best: tuple[str, Proportion] | None = None
    for parameter in parameters:
        cut = levels(parameter, flights, min(_PLACES, bin_count(len(flights))))
        for first, last in _places(cut):
            which = (first <= cut.codes) & (cut.codes <= last)
            share = clustered(flights.lost[which], together[which])
            if share.of >= _LEAST_IN_A_PLACE and (best is None or share.low > best[1].low):
                best = f"{parameter.name} {cut.span(first, last)}", share
    overall = float(flights.lost.mean())
    return best if best is not None and best[1].low > overall else None


def _places(cut: Levels) -> Iterator[tuple[int, int]]:
    """First and last level of each."""
    is_number = cut.edges is not None or cut.values is not None
    for first in range(cut.count):
        for last in range(first, cut.count if is_number else first + 1):
            if last - first + 1 < cut.count:
                yield first, last


def _hurts(campaign: Campaign, found: Sensitivity) -> tuple[str, ...]:
    said = []
    apart = dict(_by_controller(campaign))
    for group in found.groups:
        head = "All flights" if group == ALL else name_of(group)
        flights = campaign.flights if group == ALL else apart[group]
        if len(flights) and flights.lost.all():
            said.append(f"{head}: nothing can be told, all were lost.")
            continue
        seen = [one for one in found.of(group, "error") if one.seen]
        known = found.of(group, "error")
        if not known:
            continue
        told = _ranking(seen) if seen else "no parameter is told from chance"
        said.append(f"{head}: {told}.")
    if not said:
        return ("Too few flights, or too few that differ, to tell.",)
    return (*said, "Figures are shares of the variance of the error's rank, with 95 % intervals.")


def _ranking(seen: list[Influence]) -> str:
    first, *rest = seen
    text = (
        f"{first.parameter} hurts most, {index_text(first)}: median error {mm(first.best_value)} "
        f"at {first.best}, {mm(first.worst_value)} at {first.worst}"
    )
    if rest:
        text += "; then " + ", ".join(f"{one.parameter} {index_text(one)}" for one in rest[:3])
    return text


def _flights(count: int) -> str:
    return f"{count} flight" if count == 1 else f"{count} flights"


def index_text(one: Influence) -> str:
    """A share of the variance with its interval."""
    share = one.share
    if math.isnan(share.value):
        return "–"
    text = f"{share.value:.2f}"
    return text if math.isnan(share.low) else f"{text} ({share.low:.2f} … {share.high:.2f})"


def share_text(share: Proportion) -> str:
    """A share with its interval, in per cent."""
    if not share.of:
        return "–"
    return f"{_points(share.share)} % ({_points(share.low)} … {_points(share.high)} %)"


def mm(value_m: float, unit: str = " mm") -> str:
    """A length for a person; an infinite one is a lost flight's."""
    if math.isnan(value_m):
        return "–"
    if math.isinf(value_m):
        return "lost"
    value = value_m * _MM
    return f"{value:.1f}{unit}" if value < 99.95 else f"{value:.0f}{unit}"


def _points(share: float) -> str:
    value = 100.0 * share
    return f"{value:.0f}" if value in (0.0, 100.0) or 9.95 <= value <= 90.0 else f"{value:.1f}"
