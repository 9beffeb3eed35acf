"""The picture of a comparison: `compare.png`.

A panel for each wind, a row for each perturbation, a point for each controller: its error, at the
end of a line that begins at its own error on the nominal vehicle.  The further left the better; a
long line is a perturbation that it bears badly; a cross at the right are lost flights.
"""

import math
from bisect import bisect
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.report.compare_results import NOMINAL, Cell, Comparison, file_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = ("#7f8c8d", "#1f6fb4", "#e08214", "#5aae61", "#9970ab", "#35978f")
"""The first controller, to which all are compared, is grey."""
_TROUBLE = "#c0392b"
_SMALL_PRINT, _BAND = "#555555", "#f4f6f7"
_SPACE = "\u00a0\u00a0"
"""Beside a point; plain spaces would be lost in SVG."""
_MM = 1e3
_WIDE_IN, _DPI = 10.0, 100
_ROW_HEIGHT_IN = 0.34
_WORTH_TELLING = 1.2
_RIGHT, _BETWEEN_PANELS = 0.985, 0.06
_LABEL_PX = 100.0
"""Room for the text beside the rightmost point."""
_NARROW_DECADES_PX = (65.0, 110.0)
_TICK_STEPS = (
    (1,),
    (1, 3),
    (1, 2, 5),
    (1, 1.5, 2, 3, 5, 7),
    (1, 1.2, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8, 9),
    tuple(0.1 * tenths for tenths in range(10, 100)),
)
"""Ticks of a decade; the wider it is drawn, the more, and as many as a scale needs to be read."""
_FEWEST_TICKS = 3
_TICK_LABEL_PX = 20.0
"""Half of the widest."""

Colour = str | tuple[str, float]
"""A name, or one with its opacity."""
Axes = Any
"""matplotlib's; it is imported only when something is drawn."""


def draw_comparison(comparison: Comparison, path: Path) -> None:
    """Draw a comparison.

    Raises:
        OSError: the file can't be written.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    comparison_figure(comparison).savefig(path, dpi=_DPI)


def comparison_figure(
    comparison: Comparison, *, small_print: str = _SMALL_PRINT, band: Colour = _BAND
) -> "Figure":
    """The figure, as it is set now (`matplotlib.rc_context`).

    Args:
        comparison: what it shows.
        small_print: colour of the explanation below.
        band: colour of every other row's ground.
    """
    from matplotlib.figure import Figure

    rows = _rows(comparison)
    panels = comparison.winds if len(comparison.perturbations) > 1 else (None,)
    share = max(1.0, 0.55 * len(comparison.controllers))
    height = 1.85 + _ROW_HEIGHT_IN * share * len(rows)
    figure = Figure(figsize=(_WIDE_IN, height))
    figure.suptitle(
        _title(comparison), fontsize=13, x=0.015, y=1.0 - 0.12 / height, ha="left", va="top"
    )
    grid = figure.add_gridspec(
        1, len(panels), left=_left(rows), right=_RIGHT,
        bottom=0.85 / height, top=1.0 - 0.95 / height, wspace=_BETWEEN_PANELS,
    )  # fmt: skip
    panel_px = _panel_px(rows, len(panels))
    limits = _limits(comparison, panel_px)
    first: Axes = None
    for k, wind in enumerate(panels):
        axes = figure.add_subplot(grid[0, k], sharey=first)
        first = first or axes
        _prepare(axes, comparison, rows, band, labelled=k == 0)
        _scale(axes, limits, panel_px)
        title = "" if wind is None else file_name(wind)
        axes.set_title(title, fontsize=11, loc="left", fontweight="bold")
        for index, controller in enumerate(comparison.controllers):
            _draw_controller(axes, comparison, controller, index, wind, rows, limits)
    _legend(figure, comparison, height)
    figure.text(
        0.015, 0.1 / height, _explanation(comparison), fontsize=8, color=small_print, va="bottom"
    )
    return figure


def _rows(comparison: Comparison) -> list[tuple[str, str]]:
    """Name and text of each row, from the top."""
    if len(comparison.perturbations) > 1:
        return [(p.name, p.says) for p in comparison.perturbations]
    return [(wind, file_name(wind)) for wind in comparison.winds]


def _cells(comparison: Comparison, controller: str, wind: str | None) -> list[Cell]:
    """A controller's cells of a panel, by row."""
    if wind is None:
        return [comparison.cell(controller, row, NOMINAL) for row, _ in _rows(comparison)]
    return [comparison.cell(controller, wind, row) for row, _ in _rows(comparison)]


def _title(comparison: Comparison) -> str:
    seeds = len(comparison.seeds)
    trajectories = comparison.trajectories
    return (
        f"{comparison.vehicle}, {comparison.autopilot}: mean tracking error, "
        f"{'trajectories' if len(trajectories) > 1 else 'trajectory'} {', '.join(trajectories)}, "
        f"{seeds} seed{'s' if seeds > 1 else ''}"
    )


def _explanation(comparison: Comparison) -> str:
    against = "true" if comparison.against == "truth" else "reported"
    text = f"Error of the {against} position. ✕: flights lost."
    if len(comparison.perturbations) > 1:
        allowed = sorted({p.bearable for p in comparison.perturbations if p.name != NOMINAL})
        told = f"{allowed[0]:g}" + "".join(f", {a:g} in the rows below" for a in allowed[1:])
        text = (
            "A line begins at the controller's own error on the nominal vehicle; the factor is to "
            f"that, red where it is more than {told}.\n{text}"
        )
    return text


def _left(rows: list[tuple[str, str]]) -> float:
    return 0.03 + 0.0073 * max(len(text) for _, text in rows)


def _panel_px(rows: list[tuple[str, str]], panels: int) -> float:
    """Width of a panel."""
    whole = (_RIGHT - _left(rows)) * _WIDE_IN * _DPI
    return whole / (panels + _BETWEEN_PANELS * (panels - 1))


def _limits(comparison: Comparison, panel_px: float) -> tuple[float, float]:
    """Of the axis, mm; with room for the text beside the rightmost point, and for lost flights."""
    known = [c.mean_error_m * _MM for c in comparison.cells if not c.lost and c.mean_error_m > 0.0]
    low, high = (min(known), max(known)) if known else (1.0, 10.0)
    span = math.log10(high / low) + 0.15
    low_share, high_share = 12.0 / panel_px, _LABEL_PX / panel_px
    whole = span / (1.0 - low_share - high_share)
    return low / 10.0 ** (low_share * whole), high * 10.0 ** (high_share * whole + 0.15)


def _scale(axes: Axes, limits: tuple[float, float], panel_px: float) -> None:
    """A logarithmic axis with ticks that can be read."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

    axes.set_xscale("log")
    axes.set_xlim(*limits)
    decade_px = panel_px / math.log10(limits[1] / limits[0])
    highest = limits[1] / 10.0 ** (_TICK_LABEL_PX / decade_px)
    for steps in _TICK_STEPS[bisect(_NARROW_DECADES_PX, decade_px) :]:
        ticks = [m * 10.0**e for e in range(-2, 6) for m in steps]
        within: list[float] = []
        for tick in (tick for tick in ticks if limits[0] <= tick <= highest):
            if not within or decade_px * math.log10(tick / within[-1]) > 2.0 * _TICK_LABEL_PX:
                within.append(tick)
        if len(within) >= _FEWEST_TICKS:
            break
    axes.xaxis.set_major_locator(FixedLocator(within))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("mm, logarithmic", fontsize=9)


def _prepare(
    axes: Axes,
    comparison: Comparison,
    rows: list[tuple[str, str]],
    band: Colour,
    *,
    labelled: bool,
) -> None:
    axes.set_ylim(len(rows) - 0.5, -0.5)
    if labelled:
        axes.set_yticks(range(len(rows)), [text for _, text in rows])
    axes.tick_params(axis="y", labelsize=10, length=0, labelleft=labelled)
    axes.tick_params(axis="x", labelsize=9)
    axes.grid(axis="x", alpha=0.35, lw=0.6)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    for k in range(0, len(rows), 2):
        axes.axhspan(k - 0.5, k + 0.5, color=band, zorder=-5, lw=0)
    kinds = [p.bearable for p in comparison.perturbations]
    for k in range(1, len(kinds)):
        if kinds[k] != kinds[k - 1] and len(kinds) > 1:
            axes.axhline(k - 0.5, color="#808b96", lw=0.8)


def _draw_controller(
    axes: Axes,
    comparison: Comparison,
    controller: str,
    index: int,
    wind: str | None,
    rows: list[tuple[str, str]],
    limits: tuple[float, float],
) -> None:
    colour = _COLOURS[index % len(_COLOURS)]
    count = len(comparison.controllers)
    offset = 0.0 if count == 1 else 0.7 * (index / (count - 1) - 0.5) * (1.0 - 1.0 / (count + 1))
    for row, cell in enumerate(_cells(comparison, controller, wind)):
        y = row + offset
        if cell.lost:
            text = f"✕ lost {cell.lost} of {len(cell.flights)} "
            axes.text(
                limits[1], y, text, ha="right", va="center",
                fontsize=9, color=colour, fontweight="bold",
            )  # fmt: skip
            continue
        error = cell.mean_error_m * _MM
        times = comparison.to_nominal(cell)
        if wind is not None and math.isfinite(times):
            axes.plot([error / times, error], [y, y], color=colour, lw=2.2, alpha=0.45, zorder=2)
        axes.plot([error], [y], marker="o", ms=6.5, color=colour, ls="none", zorder=3)
        text = f"{_SPACE}{error:.1f}" if error < 100.0 else f"{_SPACE}{error:.0f}"
        bad = not comparison.bears(cell)
        if wind is not None and (bad or times >= _WORTH_TELLING):
            text += f"  ({times:.1f} ×)"
        rightmost = max(error, error / times) if math.isfinite(times) else error
        axes.text(
            rightmost, y, text, ha="left", va="center", fontsize=9,
            color=_TROUBLE if bad else colour, fontweight="bold" if bad else "normal",
        )  # fmt: skip


def _legend(figure: Any, comparison: Comparison, height: float) -> None:  # noqa: ANN401
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], marker="o", ms=7, ls="none", color=_COLOURS[k % len(_COLOURS)], label=label)
        for k, label in enumerate(comparison.controllers)
    ]
    figure.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(0.005, 1.0 - 0.42 / height),
        ncols=min(4, len(handles)), fontsize=11, frameon=False, handletextpad=0.1,
        columnspacing=1.2, borderaxespad=0.0,
    )  # fmt: skip
