"""Which figures a campaign's report has, in the order of the page."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from companion.experiments.campaign_report.draw_errors import error_curves
from companion.experiments.campaign_report.draw_map import cell_count, error_map, limits
from companion.experiments.campaign_report.draw_parameters import error_against
from companion.experiments.campaign_report.draw_shares import share_panel
from companion.experiments.campaign_report.drawing import Panel
from companion.experiments.campaign_report.influence import ALL, CONTROLLER, Sensitivity
from companion.experiments.campaign_report.levels import SEED, bin_count, levels
from companion.experiments.campaign_report.read import Campaign, Flights, Parameter
from companion.report.pages.style import name_of

_MOST_APART = 4
"""Controllers that one figure tells apart."""
_MOST_PARAMETERS = 12
_MOST_MAPS = 6


@dataclass(frozen=True, slots=True)
class Figures:
    """Of the report, by its parts."""

    errors: tuple[Panel, ...]
    shares: tuple[Panel, ...]
    parameters: tuple[Panel, ...]
    maps: tuple[Panel, ...]
    mapped: tuple[str, ...]
    """The two parameters of the maps; none if there are no two."""


def draw_figures(campaign: Campaign, found: Sensitivity) -> Figures:
    """Draw all of them."""
    flights = campaign.flights
    if not len(flights):
        return Figures((), (), (), (), ())
    by_controller = _by_controller(campaign)
    errors = tuple(
        error_curves(which, {name: getattr(some, f"{which}_error_m") for name, some in pairs})
        for which, pairs in (("mean", by_controller), ("max", by_controller))
    )
    order = _by_influence(campaign, found)
    mapped = [p for p in order if p.name not in (CONTROLLER, SEED)][:2]
    return Figures(
        errors=errors,
        shares=tuple(_shares(found)),
        parameters=tuple(_against(campaign, order)),
        maps=tuple(_maps(campaign, mapped)) if len(mapped) == 2 else (),
        mapped=tuple(p.name for p in mapped) if len(mapped) == 2 else (),
    )


def _by_controller(campaign: Campaign) -> list[tuple[str, Flights]]:
    flights = campaign.flights
    varying = campaign.parameter(CONTROLLER)
    if varying is None:
        given = flights.values.get(CONTROLLER)
        base = campaign.manifest.said.get("base") or {}
        name = str(given[0]) if given is not None else str(base.get(CONTROLLER, "flights"))
        return [(name, flights)]
    names = flights.values[CONTROLLER]
    order = [str(v) for v in varying.values or ()]
    there = [name for name in dict.fromkeys(order) if (names == name).any()]
    there += sorted(set(names.tolist()) - set(there))
    return [(name, flights.take(names == name)) for name in there]


def _by_influence(campaign: Campaign, found: Sensitivity) -> list[Parameter]:
    """Parameters, the one that decides most first; those that nothing is known of at the end."""
    place = {one.parameter: k for k, one in enumerate(found.of(ALL, "error"))}
    return sorted(campaign.parameters, key=lambda p: place.get(p.name, len(place)))


def _shares(found: Sensitivity) -> Iterable[Panel]:
    for outcome, told in (("error", "What decides the error"), ("lost", "What loses flights")):
        for group in found.groups:
            influences = found.of(group, outcome)
            if influences:
                where = "all flights" if group == ALL else name_of(group)
                name = _id("share", outcome, group)
                yield share_panel(name, f"{told}: {where}", influences)


def _against(campaign: Campaign, order: list[Parameter]) -> Iterable[Panel]:
    flights = campaign.flights
    varying = campaign.parameter(CONTROLLER)
    apart = varying is not None and len(np.unique(flights.values[CONTROLLER])) <= _MOST_APART
    numbers = [p for p in order if p.kind == "number" and p.name != SEED]
    for parameter in numbers[:_MOST_PARAMETERS]:
        cut = levels(parameter, flights, bin_count(len(flights)))
        name = _id("against", parameter.name)
        yield error_against(name, cut, flights, apart=apart)


def _maps(campaign: Campaign, mapped: list[Parameter]) -> Iterable[Panel]:
    across, up = mapped
    ends = limits(campaign.flights)
    pairs = _by_controller(campaign)
    for controller, some in pairs[:_MOST_MAPS]:
        bins = cell_count(len(some))
        title = f"{name_of(controller)}: {across.name} and {up.name}"
        name = _id("map", controller)
        cuts = levels(across, some, bins), levels(up, some, bins)
        yield error_map(name, title, *cuts, some, ends)


def _id(*words: str) -> str:
    return "-".join(re.sub(r"[^A-Za-z0-9]+", "_", word) for word in words)
