"""The table of a comparison, for a terminal."""

import math
from collections import Counter
from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from companion.report.compare_results import NOMINAL, Cell, Comparison, file_name, ratio

_MM = 1e3


def compare_table(comparison: Comparison) -> RenderableType:
    """A row for each wind, perturbation and controller, and below it what went wrong.

    It fits 80 columns: what each trajectory gave is a table of its own.
    """
    seeds = len(comparison.seeds)
    told = f"{seeds} seeds, ± spread over them" if seeds > 1 else "one seed, no spread"
    against = "the truth" if comparison.against == "truth" else "the reported position"
    parts: list[RenderableType] = [
        Text(
            f"{comparison.vehicle}, {comparison.autopilot}: mean tracking error against "
            f"{against}, mm ({told})",
            style="bold",
        ),
        _figures(comparison),
    ]
    if len(comparison.trajectories) > 1:
        title = Text("by trajectory, mm", style="bold")
        parts += [Text(), title, _by_trajectory(comparison)]
    return Group(*parts, *_ended(comparison), *_trouble(comparison))


def _table(comparison: Comparison) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("wind", overflow="fold")
    if len(comparison.perturbations) > 1:
        table.add_column("perturbed", no_wrap=True)
    table.add_column("controller", overflow="fold")
    return table


def _figures(comparison: Comparison) -> Table:
    table = _table(comparison)
    table.add_column("mean", justify="right", no_wrap=True)
    several = len(comparison.controllers) > 1
    perturbed = len(comparison.perturbations) > 1
    if several:
        table.add_column("×\nfirst", justify="right", no_wrap=True)
    if perturbed:
        table.add_column("×\nnominal", justify="right", no_wrap=True)
    table.add_column("slew\ng/s", justify="right", no_wrap=True)
    if several:
        table.add_column("×\nslew", justify="right", no_wrap=True)
    table.add_column("height\nmm", justify="right", no_wrap=True)
    for first, cell in _cells(comparison):
        row = [*_labels(comparison, cell, first=first), _mean(cell)]
        if several:
            row.append("" if first else _times(comparison.to_first(cell)))
        if perturbed:
            row.append(_to_nominal(comparison, cell))
        row.append(_number(cell.tilt_slew_rms_g_s, 2))
        if several:
            row.append("" if first else _slew_to_first(comparison, cell))
        table.add_row(*row, _mm(cell.peak_height_error_m, 0))
    return table


def _by_trajectory(comparison: Comparison) -> Table:
    table = _table(comparison)
    for name in comparison.trajectories:
        table.add_column(name, justify="right", overflow="fold")
    for first, cell in _cells(comparison):
        errors = [_mm(cell.by_trajectory_m[name]) for name in comparison.trajectories]
        table.add_row(*_labels(comparison, cell, first=first), *errors)
    return table


def _cells(comparison: Comparison) -> Iterator[tuple[bool, Cell]]:
    """Each with whether it is of the first controller, in the order in which they are told."""
    for wind in comparison.winds:
        for perturbation in comparison.perturbations:
            for index, controller in enumerate(comparison.controllers):
                yield index == 0, comparison.cell(controller, wind, perturbation.name)


def _labels(comparison: Comparison, cell: Cell, *, first: bool) -> list[RenderableType]:
    labels: list[RenderableType] = [escape(file_name(cell.wind)) if first else ""]
    if len(comparison.perturbations) > 1:
        labels.append(cell.perturbation if first else "")
    return [*labels, escape(cell.controller)]


def _mean(cell: Cell) -> Text:
    if cell.lost:
        return Text(f"lost {cell.lost} of {len(cell.flights)}", style="red")
    spread = "" if math.isnan(cell.spread_m) else f" ± {cell.spread_m * _MM:.1f}"
    return Text(f"{cell.mean_error_m * _MM:.1f}{spread}", style="bold")


def _slew_to_first(comparison: Comparison, cell: Cell) -> str:
    """Rate of the tilt command over the first controller's."""
    reference = comparison.cell(comparison.controllers[0], cell.wind, cell.perturbation)
    return _number(ratio(cell.tilt_slew_rms_g_s, reference.tilt_slew_rms_g_s), 1)


def _to_nominal(comparison: Comparison, cell: Cell) -> RenderableType:
    if cell.perturbation == NOMINAL:
        return ""
    return Text(
        _times(comparison.to_nominal(cell)), style="green" if comparison.bears(cell) else "red"
    )


def _ended(comparison: Comparison) -> list[Text]:
    """One line of how the flights ended."""
    words = Counter(flight.outcome for cell in comparison.cells for flight in cell.flights)
    told = ", ".join(f"{count} {word}" for word, count in words.most_common())
    return [Text(), Text(f"flights: {told}")]


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
