"""How errors are distributed: a curve for each controller."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullFormatter, PercentFormatter

from companion.experiments.campaign_report.drawing import MM, Panel, colours, panel
from companion.report.flight_data import Array
from companion.report.pages.style import MUTED, SMALL, name_of, say

_TOLD = {"mean": "Mean error", "max": "Greatest error"}


def error_curves(which: str, errors_m: Mapping[str, Array]) -> Panel:
    """Share of flights whose error is at most so much.

    Args:
        which: "mean" or "max".
        errors_m: (flights,) by controller; infinite for a lost flight.
    """
    told = _TOLD[which]
    flights = sum(len(errors) for errors in errors_m.values())
    lost = sum(int(np.isinf(errors).sum()) for errors in errors_m.values())
    caption = f"Share of {flights} flights whose {told.lower()} is at most so much."
    if lost:
        caption += " A curve that ends below 100 % lost the rest."
    shade = colours(tuple(errors_m))

    def draw(axes: Axes) -> None:
        if flights == lost:
            say(axes, "No flight tracked to the end")
            return
        for name, errors in errors_m.items():
            _curve(axes, errors, shade[name], name_of(name))
        axes.set_ylim(0.0, 1.03)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
        log_mm(axes, "x", f"{told.lower()}, mm")
        if len(errors_m) > 1:
            axes.legend(loc="lower right")

    return panel(f"{which}-errors", f"{told} by controller", caption, draw)


def _curve(axes: Axes, errors_m: Array, colour: str, label: str) -> None:
    finite = np.sort(errors_m[np.isfinite(errors_m)]) * MM
    if not len(finite):
        axes.plot([], [], color=colour, label=f"{label} (all lost)")
        return
    reached = np.arange(1, len(finite) + 1) / len(errors_m)
    x = np.concatenate([finite[:1], finite])
    axes.step(x, np.concatenate([[0.0], reached]), where="post", color=colour, label=label)
    if len(finite) < len(errors_m):
        axes.plot(x[-1], reached[-1], "x", color=colour, ms=6)


def log_mm(axes: Axes, which: str, label: str) -> None:
    """A logarithmic axis of millimetres with plain figures on it."""
    axis = axes.xaxis if which == "x" else axes.yaxis
    (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    low, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    ticks = [t for t in _ticks(low, high) if low <= t <= high]
    axis.set_ticks(ticks)
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
    axis.set_tick_params(which="minor", length=0)
    (axes.set_xlabel if which == "x" else axes.set_ylabel)(f"{label} (logarithmic)")


def _ticks(low: float, high: float) -> list[float]:
    """1, 2, 5 or, over a wide range, powers of ten; more figures over a narrow one."""
    decades = np.log10(high / low)
    steps = (1,) if decades > 3.0 else (1, 2, 5) if decades > 0.7 else (1, 1.5, 2, 3, 4, 5, 6, 8)
    first, last = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    return [step * 10.0**k for k in range(first, last + 1) for step in steps]


def remark(axes: Axes, text: str) -> None:
    """A word above the axes, on the right."""
    axes.text(1.0, 1.03, text, transform=axes.transAxes, ha="right", fontsize=SMALL, color=MUTED)
