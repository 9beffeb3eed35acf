"""MPC-PID with a model tuned for one trajectory, flown on all: a table in colours."""

import math

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from companion.experiments.paper.results import PaperResults
from companion.experiments.paper.scale import TRAJECTORIES
from companion.report.pages.style import (
    INK,
    MUTED,
    ON_COLOUR,
    PAPER,
    new_figure,
    seeds_text,
)
from companion.trajectories.harmonic import TEST_TRAJECTORIES

_MM = 1e3
_MOST = 2.0
"""The colour's end: this many times the error of the trajectory's own model, or its inverse."""
_COLOURS = "RdBu_r"
_GAP = 0.35


def caption(results: PaperResults) -> str:
    """What is drawn."""
    table = results.model_transfer
    return (
        "MPC-PID in calm air: mean error in millimetres on the trajectory of the column with the "
        "MPC's model tuned for the trajectory of the row (framed: at home); the last row is the "
        f"one model identified from steps. {_seeds(results)} The colour is the ratio to the "
        "trajectory's own model, from half (blue) over equal (white) to twice (red). "
        f"{_factors(results)}A foreign model is worse than "
        f"the trajectory's own in {100 * table.harmed_away:.0f} % of the cells."
    )


def _factors(results: PaperResults) -> str:
    home, away = results.model_transfer.gain_at_home, results.model_transfer.loss_away
    if not math.isfinite(home) or not math.isfinite(away):
        return ""
    return (
        f"At home, tuning changes the error by a factor of {home:.2f}; on foreign trajectories by "
        f"{away:.2f} (geometric means). "
    )


def _seeds(results: PaperResults) -> str:
    text = seeds_text(results.scale.seeds)
    return text[0].upper() + text[1:] + "."


def draw(results: PaperResults) -> Figure:
    """Draw."""
    figure = new_figure(4.6)
    axes = figure.add_subplot()
    table = results.model_transfer
    own = np.diagonal(table.errors_m)
    count = len(TRAJECTORIES)
    for row in range(count):
        for column in range(count):
            value = float(table.errors_m[row, column])
            _cell(axes, row, column, value, float(own[column]))
        axes.add_patch(
            Rectangle((row, row), 1, 1, fill=False, edgecolor=INK, linewidth=2.0, zorder=3)
        )
    for column in range(count):
        spread = table.identified[column]
        _cell(axes, count + _GAP, column, spread.mean, float(own[column]), spread.std)
    axes.set_xlim(0, count)
    axes.set_ylim(count + 1 + _GAP, 0)
    names = [TEST_TRAJECTORIES[number].name for number in TRAJECTORIES]
    axes.set_xticks([k + 0.5 for k in range(count)], names)
    rows = [k + 0.5 for k in range(count)] + [count + _GAP + 0.5]
    axes.set_yticks(rows, [f"tuned for {name}" for name in names] + ["identified by steps"])
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(visible=False)
    for side in axes.spines.values():
        side.set_visible(False)
    axes.set_title("mean error, mm, by the trajectory flown", pad=8)
    return figure


def _cell(
    axes: Axes, row: float, column: int, value_m: float, own_m: float, std: float = math.nan
) -> None:
    if not math.isfinite(value_m):
        axes.add_patch(
            Rectangle(
                (column, row), 1, 1, facecolor="none", edgecolor=MUTED, hatch="////", linewidth=0
            )
        )
        axes.text(
            column + 0.5,
            row + 0.5,
            "lost",
            ha="center",
            va="center",
            bbox={"facecolor": PAPER, "edgecolor": "none", "pad": 3},
        )
        return
    known = math.isfinite(own_m) and own_m > 0.0 and value_m > 0.0
    ratio = math.log2(value_m / own_m) / math.log2(_MOST) if known else 0.0
    # The ends of the map are too dark for letters.
    shade = colormaps[_COLOURS](0.5 + 0.32 * Normalize(-1, 1, clip=True)(ratio) * 2 - 0.32)
    axes.add_patch(Rectangle((column, row), 1, 1, facecolor=shade, edgecolor="none"))
    text = f"{value_m * _MM:.1f}"
    if math.isfinite(std):
        text += f" ± {std * _MM:.1f}"
    axes.text(column + 0.5, row + 0.5, text, ha="center", va="center", fontsize=10, color=ON_COLOUR)
