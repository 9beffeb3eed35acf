"""The error over two parameters at once: a map of cells."""

import math
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.patches import Rectangle

from companion.experiments.campaign_report.drawing import MM, Panel, panel
from companion.experiments.campaign_report.levels import Levels, plain_numbers
from companion.experiments.campaign_report.read import Flights
from companion.report.flight_data import Array
from companion.report.pages.style import FAINT, MUTED, ON_COLOUR, SMALL

_SHADES = LinearSegmentedColormap.from_list("errors", ["#d7ebdf", "#fdf0c4", "#f6b26b", "#e8836f"])
"""Light enough for dark letters, by day and by night."""
_LOST = "#c9a0dc"
_MANY_COLUMNS = 6
_LONG = 5
_SLANTED: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"}


def cell_count(flights: int) -> int:
    """How many bins an axis has, so that a cell has some eight flights."""
    return int(min(7, max(3, math.sqrt(flights / 8.0))))


def error_map(
    name: str,
    title: str,
    across: Levels,
    up: Levels,
    flights: Flights,
    limits_mm: tuple[float, float],
) -> Panel:
    """Draw the median error of each cell, and how many of its flights were lost.

    Args:
        name: of the panel.
        title: over it.
        across: parameter along x.
        up: parameter along y.
        flights: that the levels are of.
        limits_mm: errors at the ends of the colours, the same for all maps of a page.
    """
    caption = (
        "In each cell the median of the mean error, mm, a lost flight counted as worst; "
        "below it, if any, how many of its flights were lost. Ends of the bins stand at the axes."
    )

    def draw(axes: Axes) -> None:
        norm = LogNorm(*limits_mm)
        for j in range(up.count):
            for k in range(across.count):
                here = flights.mean_error_m[(across.codes == k) & (up.codes == j)]
                _cell(axes, k, j, here, norm, small=across.count >= _MANY_COLUMNS)
        axes.grid(visible=False)
        axes.set_xlim(0, across.count)
        axes.set_ylim(0, up.count)
        _label(axes, across, along_x=True)
        _label(axes, up, along_x=False)

    return panel(name, title, caption, draw)


def limits(flights: Flights) -> tuple[float, float]:
    """Errors at the ends of the colours, mm."""
    finite = flights.mean_error_m[np.isfinite(flights.mean_error_m)] * MM
    if not len(finite):
        return 1.0, 10.0
    low, high = np.quantile(finite, [0.05, 0.95]).tolist()
    low = max(low, 1e-6)
    return (low, high) if high > 1.05 * low else (low / 1.5, low * 1.5)


def _cell(axes: Axes, k: int, j: int, errors_m: Array, norm: LogNorm, *, small: bool) -> None:
    if not len(errors_m):
        return
    median = float(np.quantile(errors_m, 0.5, method="inverted_cdf")) * MM
    lost = int(np.isinf(errors_m).sum())
    known = math.isfinite(median)
    colour = mpl.colors.to_hex(_SHADES(norm(median))) if known else _LOST
    axes.add_patch(Rectangle((k, j), 1, 1, facecolor=colour, edgecolor=FAINT, lw=0.8))
    lines = [f"{median:.1f}" if median < 99.95 else f"{median:.0f}"] if known else []
    if lost:
        lines.append(f"{lost}/{len(errors_m)}" + ("" if small else " lost"))
    axes.text(
        k + 0.5, j + 0.5, "\n".join(lines), ha="center", va="center", color=ON_COLOUR,
        fontsize=SMALL - (1.0 if small else 0.0), linespacing=1.1,
    )  # fmt: skip


def _label(axes: Axes, cut: Levels, *, along_x: bool) -> None:
    """Choices and single values at the middle of a cell, ends of bins between cells."""
    unit = f", {cut.parameter.unit}" if cut.parameter.unit else ""
    if cut.edges is not None:
        places: list[float] = [float(k) for k in range(cut.count + 1)]
        told = plain_numbers(cut.edges)
    elif cut.values is not None:
        places = [k + 0.5 for k in range(cut.count)]
        told = [f"{value:.3g}".replace("-", "−") for value in cut.values]
    else:
        places, told = [k + 0.5 for k in range(cut.count)], list(cut.labels)
    if along_x:
        slanted = max(map(len, told)) > _LONG
        turned: dict[str, Any] = (
            {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if slanted else {}
        )
        axes.set_xticks(places, told, **turned)
        axes.set_xlabel(cut.parameter.name + unit)
    else:
        axes.set_yticks(places, told)
        axes.set_ylabel(cut.parameter.name + unit)
    axes.tick_params(length=3, color=MUTED)
