"""What moving the laboratory's origin does to the two costs."""

import math

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.experiments.paper.figures.bars import Bar, Series, draw_bars
from companion.experiments.paper.origin import COSTS, SHIFT_ENU_M, TRAJECTORY, CostFigures
from companion.experiments.paper.results import PaperResults
from companion.report.pages.style import (
    MPC_L1,
    MPC_L1_FAN,
    legend_above,
    new_figure,
    percent,
)

_MM = 1e3
_NAMES = {
    "r_minus_target": "R on r − y* (the default)",
    "absolute_r": "R on r (the paper's letter)",
}


def caption(results: PaperResults) -> str:
    """What is drawn."""
    shift = ", ".join(f"{value:g}" for value in SHIFT_ENU_M).replace("-", "−")
    changes = "; ".join(
        f"{_NAMES[cost]}: moving changes the error by {percent(figures.change)}"
        + (
            f" (at most {percent(figures.largest_change)} on any trajectory flown so)"
            if math.isfinite(figures.largest_change)
            else ""
        )
        + (
            f", the hover is {figures.hover_offset_m * _MM:.1f} mm off"
            if math.isfinite(figures.hover_offset_m)
            else ""
        )
        for cost, figures in results.origin.items()
        if math.isfinite(figures.change)
    )
    return (
        f"MPC-L1 with its two costs, in calm air, seed {results.scale.seeds[0]}. Left: the mean "
        f"error in millimetres on trajectory {TRAJECTORY} about the origin and moved by "
        f"({shift}) m. Right: how far from the wanted point it hovers there, on average, in "
        "millimetres. A penalty on the absolute reference pulls towards the laboratory's origin."
        + (f" {changes}." if changes else "")
        + _compared(results)
    )


def _compared(results: PaperResults) -> str:
    """Which of the costs does better where."""
    default, letter = (results.origin.get(cost) for cost in COSTS)
    if default is None or letter is None:
        return ""
    places = (
        ("About the origin itself", default.error_here_m, letter.error_here_m),
        ("moved away from it", default.error_there_m, letter.error_there_m),
    )
    said = [
        f"{place} the paper's letter does {'better' if its < ours else 'worse'} "
        f"({its * _MM:.1f} against {ours * _MM:.1f} mm)"
        for place, ours, its in places
        if math.isfinite(ours) and math.isfinite(its)
    ]
    text = ", ".join(said)
    return f" {text[0].upper()}{text[1:]}." if text else ""


def draw(results: PaperResults) -> Figure:
    """Draw."""
    figure = new_figure(3.8)
    error, hover = figure.subplots(1, 2, width_ratios=[3, 2])
    flown = [(cost, results.origin[cost]) for cost in COSTS if cost in results.origin]
    _draw_errors(error, flown)
    groups = [_NAMES[cost].replace(" (", "\n(") for cost, _ in flown]
    offsets = [Bar(figures.hover_offset_m * _MM) for _, figures in flown]
    draw_bars(hover, groups, [Series("hover offset", MPC_L1, offsets)])
    hover.set_title("offset of a hover there, mm")
    return figure


def _draw_errors(axes: Axes, flown: list[tuple[str, CostFigures]]) -> None:
    groups = [_NAMES[cost].replace(" (", "\n(") for cost, _ in flown]
    here = [Bar(figures.error_here_m * _MM) for _, figures in flown]
    there = [Bar(figures.error_there_m * _MM) for _, figures in flown]
    draw_bars(
        axes,
        groups,
        [Series("about the origin", MPC_L1, here), Series("moved", MPC_L1_FAN, there)],
    )
    axes.set_title("mean error, mm")
    legend_above(axes)
