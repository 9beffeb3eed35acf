"""The summary box of a comparison: did all track, and which controller tracks best."""

import math

from companion.report.compare_results import NOMINAL, Cell, Comparison, file_name
from companion.report.pages.glance import Glance, KeyFigure, Level

_MOST_REASONS = 8
_MM = 1e3


def comparison_glance(comparison: Comparison) -> Glance:
    """The box."""
    flights = [flight for cell in comparison.cells for flight in cell.flights]
    lost = sum(flight.lost for flight in flights)
    kept = len(flights) - lost
    sentence = (
        f"All {len(flights)} flights tracked to the end"
        if not lost
        else f"{kept} of {len(flights)} flights tracked to the end"
    )
    best = [text for wind in comparison.winds if (text := _best(comparison, wind))]
    if best:
        sentence += f"; {'; '.join(best)}"
    reasons = [*_lost(comparison), *_not_borne(comparison)]
    level: Level = "bad" if not kept else "half" if reasons else "good"
    return Glance(level, f"{sentence}.", _figures(comparison, kept), tuple(reasons[:_MOST_REASONS]))


def _best(comparison: Comparison, wind: str) -> str:
    """Who has the smallest error on the nominal vehicle, and how much smaller it is."""
    cells = [comparison.cell(controller, wind, NOMINAL) for controller in comparison.controllers]
    known = [cell for cell in cells if not cell.lost and math.isfinite(cell.mean_error_m)]
    if not known:
        return ""
    best = min(known, key=lambda cell: cell.mean_error_m)
    text = f"{best.mean_error_m * _MM:.1f} mm on average by {best.controller} ({file_name(wind)}"
    rest = [cell for cell in known if cell is not best]
    if rest:
        second = min(rest, key=lambda cell: cell.mean_error_m)
        ratio = second.mean_error_m / best.mean_error_m
        text += f"; {second.controller} {ratio:.1f} × as much"
    return f"{text})"


def _lost(comparison: Comparison) -> list[str]:
    """A sentence for each place where flights were lost."""
    said = []
    for cell in comparison.cells:
        if cell.lost:
            notes = dict.fromkeys(flight.note for flight in cell.flights if flight.lost)
            why = "; ".join(note for note in notes if note) or "no reason is known"
            said.append(
                f"{cell.lost} of {len(cell.flights)} lost: {place(comparison, cell)}: {why}"
            )
    return said


def _not_borne(comparison: Comparison) -> list[str]:
    """A sentence for each perturbation that costs more than it may."""
    allowed = {p.name: p.bearable for p in comparison.perturbations}
    return [
        f"{place(comparison, cell)}: {comparison.to_nominal(cell):.1f} × its error on the nominal "
        f"vehicle, more than {allowed[cell.perturbation]:g} ×."
        for cell in comparison.cells
        if not cell.lost and not comparison.bears(cell)
    ]


def place(comparison: Comparison, cell: Cell) -> str:
    """Controller, wind and perturbation in words."""
    words = [cell.controller, file_name(cell.wind)]
    if cell.perturbation != NOMINAL:
        words.append(next(p.says for p in comparison.perturbations if p.name == cell.perturbation))
    return ", ".join(words)


def _figures(comparison: Comparison, kept: int) -> tuple[KeyFigure, ...]:
    flights = sum(len(cell.flights) for cell in comparison.cells)
    borne = [cell for cell in comparison.cells if cell.perturbation != NOMINAL]
    figures = [
        KeyFigure(
            "tracked to the end", f"{kept} of {flights}", "", None if kept == flights else "half"
        )
    ]
    if borne:
        good = sum(comparison.bears(cell) for cell in borne)
        level: Level | None = None if good == len(borne) else "half"
        figures.append(KeyFigure("perturbations borne", f"{good} of {len(borne)}", "", level))
    wind = comparison.winds[0]
    for controller in comparison.controllers:
        cell = comparison.cell(controller, wind, NOMINAL)
        if not cell.lost:
            name = f"{controller}, {file_name(wind)}"
            figures.append(KeyFigure(name, f"{cell.mean_error_m * _MM:.1f}", "mm"))
    return tuple(figures)
