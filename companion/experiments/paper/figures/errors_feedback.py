"""Mean errors of the three controllers above L1: two that feed back only, one that looks ahead."""

import math

from matplotlib.figure import Figure

from companion.experiments.paper.figures.bars import Bar, Series, bar_of, draw_bars
from companion.experiments.paper.results import PaperResults
from companion.experiments.paper.scale import TRAJECTORIES
from companion.experiments.paper.tracking import Errors
from companion.report.pages.style import (
    COLOURS,
    legend_above,
    name_of,
    new_figure,
    seeds_text,
)
from companion.trajectories.harmonic import TEST_TRAJECTORIES

_CONTROLLERS = ("pid-l1", "lqr-l1", "mpc-l1")
_MM = 1e3


def caption(results: PaperResults) -> str:
    """What is drawn."""
    calm = {name: results.tracking.errors[name]["calm"].mean.mean for name in _CONTROLLERS}
    ratios = ", ".join(
        f"{name_of(name)} {calm[name] / calm['mpc-l1']:.1f} times"
        for name in _CONTROLLERS[:2]
        if math.isfinite(calm[name]) and math.isfinite(calm["mpc-l1"])
    )
    return (
        "Mean distance |y2* − y2| from the desired path in millimetres, against the true position, "
        f"in calm air, on each trajectory and on average; {seeds_text(results.scale.seeds)}. "
        "PID-L1 and LQR-L1 see only the present desired position and lag behind it; MPC-L1 sees "
        "the next second of the path."
        + (
            f" On average over the five, the error of MPC-L1 is exceeded by {ratios}."
            if ratios
            else ""
        )
    )


def draw(results: PaperResults) -> Figure:
    """Draw."""
    figure = new_figure(4.2)
    axes = figure.add_subplot()
    best = results.tracking.errors["mpc-l1"]["calm"].mean.mean
    draw_bars(
        axes,
        [TEST_TRAJECTORIES[number].name for number in TRAJECTORIES] + ["mean of the five"],
        [
            Series(name_of(name), COLOURS[name], _bars(results.tracking.errors[name]["calm"], best))
            for name in _CONTROLLERS
        ],
    )
    axes.set_title("mean error in calm air, mm")
    legend_above(axes)
    return figure


def _bars(errors: Errors, best_m: float) -> list[Bar]:
    ratio = errors.mean.mean / best_m if math.isfinite(best_m) else math.nan
    note = f"{ratio:.1f}×" if math.isfinite(ratio) and ratio != 1.0 else ""
    bars = [bar_of(errors.by_trajectory[number], _MM) for number in TRAJECTORIES]
    return [*bars, bar_of(errors.mean, _MM, note)]
