"""soak.png: four panels for each run, with the fitted lines."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tools.soak.runs import Run
from tools.soak.verdicts import Fitted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PANEL_INCHES = (4.6, 2.9)
_COLOURS = {"passed": "tab:green", "not shown": "tab:orange", "grows": "tab:red"}


def draw(path: Path, runs: Sequence[tuple[Run, list[Fitted]]]) -> None:
    """Draw; one run as two rows of two panels, more as a row of four each.

    Raises:
        OSError: the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows, columns = (2, 2) if len(runs) == 1 else (len(runs), 4)
    width, height = _PANEL_INCHES
    figure = Figure((columns * width, rows * height), layout="constrained")
    FigureCanvasAgg(figure)
    panels = iter(figure.subplots(rows, columns, squeeze=False).flat)
    for run, fits in runs:
        for fit in fits:
            _panel(next(panels), run, fit)
    figure.savefig(path, dpi=110)


def _panel(axes: "Axes", run: Run, fit: Fitted) -> None:
    trend, gauge = fit.trend, fit.gauge
    from matplotlib.ticker import MaxNLocator

    unit_s, unit = (60.0, "min") if fit.times_h[-1] < 1.5 else (1.0, "h")
    axes.plot([t * unit_s for t in fit.times_h], fit.values, ".", color="0.6", markersize=3)
    ends_h = (fit.warm_up_h, fit.times_h[-1])
    line = [trend.at(time_h) for time_h in ends_h]
    colour = _COLOURS[fit.word]
    axes.plot([t * unit_s for t in ends_h], line, color=colour, linewidth=2)
    axes.axvspan(0.0, fit.warm_up_h * unit_s, color="0.93", zorder=0)
    axes.set_xlim(0.0, fit.times_h[-1] * unit_s)
    axes.set_title(
        f"{run.name}: {gauge.title} — {fit.word}\n{trend.slope_per_h:+.3g} {gauge.unit}/h, "
        f"95 %: ≤ {trend.upper_per_h:+.3g}, limit {gauge.limit_per_h:g}",
        fontsize=9,
    )
    axes.set_xlabel(unit)
    axes.set_ylabel(gauge.unit)
    axes.ticklabel_format(useOffset=False)
    if gauge.limit_per_h == 0.0:
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_ylim(min(fit.values) - 1.0, max(fit.values) + 1.0)
    axes.grid(alpha=0.3)
