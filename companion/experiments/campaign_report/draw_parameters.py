"""The error against one parameter: every flight, and the median of each bin."""

import math

import numpy as np
from matplotlib.axes import Axes

from companion.experiments.campaign_report.draw_errors import log_mm
from companion.experiments.campaign_report.drawing import LOST_AT, MM, Panel, colours, panel
from companion.experiments.campaign_report.levels import Levels
from companion.experiments.campaign_report.read import Flights
from companion.report.flight_data import Array
from companion.report.pages.style import MUTED, SMALL, name_of, say

_MOST_DOTS = 1500
_LEAST_FOR_A_MEDIAN = 3
_SEED = 20181


def error_against(name: str, cut: Levels, flights: Flights, *, apart: bool) -> Panel:
    """Draw the mean error of every flight over a number.

    Args:
        name: of the panel.
        cut: the number, with its bins.
        flights: all.
        apart: whether controllers have colours and lines of their own.
    """
    parameter = cut.parameter
    unit = f", {parameter.unit}" if parameter.unit else ""
    x = flights.values[parameter.name]
    lost = flights.lost
    of = flights.values["controller"] if apart else np.full(len(flights), "")
    names = tuple(dict.fromkeys(of.tolist()))
    shade = colours(names) if names != ("",) else {"": MUTED}
    shown = _some(len(flights))

    caption = "A dot is a flight; the line is the median of each bin, lost flights counted as worst"
    caption += "." if not lost.any() else "; where it stops, most were lost. ×: a lost flight."
    if len(shown) < len(flights):
        caption += f" Of {len(flights)} flights {len(shown)} are drawn, evenly by chance."
    if isinstance(parameter.nominal, float | int):
        caption += " Dashed: the nominal value."

    def draw(axes: Axes) -> None:
        if lost.all():
            say(axes, "No flight tracked to the end")
            return
        for one in names:
            which = of == one
            dots = shown[which[shown]]
            axes.plot(
                x[dots], flights.mean_error_m[dots] * MM, "o", ms=2.6, mew=0, alpha=0.45,
                color=shade[one],
            )  # fmt: skip
            middle, median = _medians(cut, x, flights.mean_error_m, which)
            axes.plot(middle, median * MM, "-", color=shade[one], lw=1.8, label=name_of(one))
            gone = dots[lost[dots]]
            if len(gone):
                places = np.full(len(gone), LOST_AT)
                axes.plot(
                    x[gone], places, "x", ms=4, mew=0.9, color=shade[one],
                    transform=axes.get_xaxis_transform(), clip_on=False,
                )  # fmt: skip
        log_mm(axes, "y", "mean error, mm")
        axes.set_xlabel(f"{parameter.name}{unit}")
        if isinstance(parameter.nominal, float | int):
            axes.axvline(float(parameter.nominal), color=MUTED, lw=0.9, ls=(0, (4, 2)))
        if lost.any():
            axes.text(
                -0.01, LOST_AT, "lost", transform=axes.transAxes, ha="right", va="center",
                fontsize=SMALL, color=MUTED,
            )  # fmt: skip
        if len(names) > 1:
            axes.legend(loc="best", handlelength=1.2)

    return panel(name, f"Mean error against {parameter.name}", caption, draw)


def _some(count: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Places of the flights that are drawn."""
    if count <= _MOST_DOTS:
        return np.arange(count)
    drawn = np.random.default_rng(_SEED).choice(count, _MOST_DOTS, replace=False)
    return np.sort(drawn)


def _medians(cut: Levels, x: Array, errors_m: Array, which: Array) -> tuple[Array, Array]:
    """Median x and error of each bin; NaN, which is not drawn, where most of it is lost."""
    middle, median = [], []
    for level in range(cut.count):
        here = which & (cut.codes == level)
        if here.sum() < _LEAST_FOR_A_MEDIAN:
            continue
        middle.append(float(np.median(x[here])))
        value = float(np.quantile(errors_m[here], 0.5, method="inverted_cdf"))
        median.append(value if math.isfinite(value) else math.nan)
    return np.array(middle), np.array(median)
