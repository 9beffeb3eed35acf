"""Computing times of the linear MPC and of nonlinear ones."""

import textwrap

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.experiments.computing_time import WHAT, ComputingTime, MethodTime
from companion.experiments.paper.results import PaperResults
from companion.report.pages.style import (
    MPC_L1,
    MUTED,
    SMALL,
    new_figure,
    say,
)

_ROW_IN = 0.46


def caption(results: PaperResults) -> str:
    """What is drawn."""
    times = results.computing_time
    if times is None:
        return (
            "Not measured: CasADi, with which the nonlinear MPC is made, is not installed "
            "(pip install 'companion[nonlinear]')."
        )
    return (
        f"Computing time of a plan in microseconds, logarithmic: dot median, line to the 99th "
        f"percentile; {times.ticks} plans along trajectory {times.trajectory}, horizon "
        f"{times.horizon} steps of {1e3 * times.period_s:g} ms, seed {times.seed}, on the machine "
        "named at the end of the page. Red: the linear MPC, called from Python; grey: nonlinear "
        f"ones of the same task and horizon in CasADi {times.casadi_version}, which moreover know "
        "the simulated vehicle's own equations. Implementations are compared, not algorithms."
    )


def draw(results: PaperResults) -> Figure:
    """Draw."""
    times = results.computing_time
    if times is None:
        figure = new_figure(1.6)
        say(figure.add_subplot(), "not measured: install companion[nonlinear] (CasADi)")
        return figure
    figure = new_figure(1.2 + _ROW_IN * len(times.methods))
    axes = figure.add_subplot()
    for row, method in enumerate(times.methods):
        _draw_method(axes, row, method)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:,g}")
    axes.set_yticks(range(len(times.methods)), [_label(method) for method in times.methods])
    axes.set_ylim(len(times.methods) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    _leave_room(axes, times)
    axes.set_title(f"time of a plan, µs (one is due every {1e6 * times.period_s:,.0f} µs)")
    return figure


def _draw_method(axes: Axes, row: int, method: MethodTime) -> None:
    colour = MPC_L1 if method.name.startswith("linear") else MUTED
    if method.median_us is None:
        axes.annotate(
            "no plan",
            (0.01, row),
            xycoords=axes.get_yaxis_transform(),
            va="center",
            fontsize=SMALL,
        )
        return
    end = method.p99_us if method.p99_us is not None else method.median_us
    axes.plot([method.median_us, end], [row, row], color=colour, lw=3.0, alpha=0.45)
    axes.plot(end, row, "|", color=colour, ms=12, mew=2.0)
    axes.plot(method.median_us, row, "o", color=colour, ms=8)
    text = f"{method.median_us:,.0f}"
    if method.ratio is not None and method.ratio != 1.0:
        text += f"   {method.ratio:.1f} ×" if method.ratio < 10.0 else f"   {method.ratio:.0f} ×"
    axes.annotate(text, (end, row), (9, 0), textcoords="offset points", va="center", fontsize=SMALL)


def _label(method: MethodTime) -> str:
    return textwrap.fill(WHAT.get(method.name, method.what), 46)


def _leave_room(axes: Axes, times: ComputingTime) -> None:
    """For the figures at the right."""
    known = [m for m in times.methods if m.median_us is not None]
    if known:
        least = min(m.median_us or 1.0 for m in known)
        most = max(m.p99_us or m.median_us or 1.0 for m in known)
        axes.set_xlim(0.6 * least, most * 5.0)
