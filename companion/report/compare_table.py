"""The table of a comparison, for a terminal."""

import math

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from companion.report.compare_results import NOMINAL, Cell, Comparison, file_name, ratio

_MM = 1e3


def compare_table(comparison: Comparison) -> RenderableType:
    """A row for each wind, perturbation and controller, and below it what went wrong."""
    seeds = len(comparison.seeds)
    told = f"{seeds} seeds, ± spread over them" if seeds > 1 else "one seed, no spread"
    against = "the truth" if comparison.against == "truth" else "the reported position"
    table = Table(
        title=f"{comparison.vehicle}, {comparison.autopilot}: mean tracking error against "
        f"{against}, mm ({told})",
        title_justify="left",
    )
    perturbed = len(comparison.perturbations) > 1
    table.add_column("wind")
    if perturbed:
        table.add_column("perturbation", no_wrap=True)
    table.add_column("controller", no_wrap=True)
    if len(comparison.trajectories) > 1:
        for name in comparison.trajectories:
            table.add_column(name, justify="right", style="dim")
    table.add_column("mean", justify="right", no_wrap=True)
    if len(comparison.controllers) > 1:
        table.add_column(f"× {comparison.controllers[0]}", justify="right")
    if perturbed:
        table.add_column("× nominal", justify="right")
    table.add_column("slew g/s", justify="right")
    table.add_column("height mm", justify="right")
    table.add_column("outcome")
    for wind in comparison.winds:
        for p in comparison.perturbations:
            for index, controller in enumerate(comparison.controllers):
                cell = comparison.cell(controller, wind, p.name)
                last = index == len(comparison.controllers) - 1
                table.add_row(*_row(comparison, cell, first=index == 0), end_section=last)
    return Group(table, *_trouble(comparison))


def _row(comparison: Comparison, cell: Cell, *, first: bool) -> list[RenderableType]:
    row: list[RenderableType] = [file_name(cell.wind) if first else ""]
    perturbed = len(comparison.perturbations) > 1
    if perturbed:
        row.append(cell.perturbation if first else "")
    row.append(escape(cell.controller))
    if len(comparison.trajectories) > 1:
        row += [_mm(cell.by_trajectory_m[name]) for name in comparison.trajectories]
    row.append(_mean(cell))
    if len(comparison.controllers) > 1:
        row.append("" if first else _times(comparison.to_first(cell)))
    if perturbed:
        row.append(_to_nominal(comparison, cell))
    row += [_slew(comparison, cell, first=first), _mm(cell.peak_height_error_m, 0)]
    row.append(_outcome(cell))
    return row


def _mean(cell: Cell) -> Text:
    if cell.lost:
        return Text("–")
    spread = "" if math.isnan(cell.spread_m) else f" ± {cell.spread_m * _MM:.1f}"
    return Text(f"{cell.mean_error_m * _MM:.1f}{spread}", style="bold")


def _slew(comparison: Comparison, cell: Cell, *, first: bool) -> str:
    """Rate of the tilt command, and over the first controller's."""
    text = _number(cell.tilt_slew_rms_g_s, 2)
    reference = comparison.cell(comparison.controllers[0], cell.wind, cell.perturbation)
    times = ratio(cell.tilt_slew_rms_g_s, reference.tilt_slew_rms_g_s)
    return text if first or not math.isfinite(times) else f"{text} ({times:.1f} ×)"


def _to_nominal(comparison: Comparison, cell: Cell) -> RenderableType:
    if cell.perturbation == NOMINAL:
        return ""
    return Text(
        _times(comparison.to_nominal(cell)), style="green" if comparison.bears(cell) else "red"
    )


def _outcome(cell: Cell) -> Text:
    if not cell.lost:
        return Text("all " + "/".join(sorted({flight.outcome for flight in cell.flights})))
    words = sorted({flight.outcome for flight in cell.flights if flight.lost})
    return Text(f"{cell.lost} of {len(cell.flights)} {'/'.join(words)}", style="red")


def _trouble(comparison: Comparison) -> list[Text]:
    """A line for each kind of loss."""
    said: dict[tuple[str, str, str, str], list[str]] = {}
    for cell in comparison.cells:
        for flight in cell.flights:
            if flight.lost:
                key = (cell.controller, cell.wind, cell.perturbation, flight.note)
                said.setdefault(key, []).append(f"{flight.trajectory} (seed {flight.seed})")
    return [
        Text(
            f"{controller}, {wind}, {perturbation}, trajectory {', '.join(flights)}: {note}",
            style="red",
        )
        for (controller, wind, perturbation, note), flights in said.items()
    ]


def _mm(value_m: float, digits: int = 1) -> str:
    return _number(value_m * _MM, digits)


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"


def _times(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "–"
