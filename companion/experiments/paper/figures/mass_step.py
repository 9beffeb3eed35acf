"""A load taken up in flight."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.experiments.paper.changing_dynamics import (
    CONTROLLERS,
    LOAD_AT_S,
    TRAJECTORY,
    LoadStep,
)
from companion.experiments.paper.figures.bars import Series, bar_of, draw_bars
from companion.experiments.paper.results import PaperResults
from companion.report.pages.style import (
    COLOURS,
    INK,
    MUTED,
    SMALL,
    name_of,
    new_figure,
    say,
    seeds_text,
    smooth,
    thin,
)

_MM = 1e3
_WINDOW_S = 0.5


def caption(results: PaperResults) -> str:
    """What is drawn."""
    load = results.changing_dynamics.load
    sags = ", ".join(
        f"{name_of(name)} {load[name].largest_sag_m * _MM:.0f} mm"
        for name in CONTROLLERS
        if name in load
    )
    return (
        f"Trajectory {TRAJECTORY} in calm air; {LOAD_AT_S:g} s into it, a load of 0.1 kg, a fifth "
        "of the vehicle's mass, is taken up and kept. Left, over time: true minus desired height "
        "in millimetres, and σ̂ of the vertical axis in m/s, pale, with the mean of "
        f"its last {_WINDOW_S:g} s (seed {results.scale.seeds[0]}). Right: the mean distance "
        "|y2* − y2| in millimetres "
        "within 2 s of the load, from 5 s after it to the end, and in the same part of a flight "
        f"without it; {seeds_text(results.scale.seeds)}."
        + (f" Greatest sag: {sags}." if sags else "")
    )


def draw(results: PaperResults) -> Figure:
    """Draw."""
    figure = new_figure(5.0)
    load = {n: results.changing_dynamics.load[n] for n in CONTROLLERS if _flown(results, n)}
    if not load:
        say(figure.add_subplot(), "none of the flights could be flown")
        return figure
    grid = figure.add_gridspec(2, 2, width_ratios=[3, 2])
    height = figure.add_subplot(grid[0, 0])
    sigma = figure.add_subplot(grid[1, 0], sharex=height)
    for name, step in load.items():
        times, values = thin(step.times_s, step.height_error_m * _MM)
        height.plot(times, values, color=COLOURS[name], lw=1.3, label=name_of(name))
        _draw_sigma(sigma, step, COLOURS[name])
    for axes in (height, sigma):
        axes.axvline(LOAD_AT_S, color=INK, lw=1.0, ls=":")
        axes.margins(x=0.01)
    height.axhline(0.0, color=MUTED, lw=0.8)
    height.annotate(
        "load",
        (LOAD_AT_S, 0.4),
        (-4, 0),
        xycoords=height.get_xaxis_transform(),
        textcoords="offset points",
        ha="right",
        fontsize=SMALL,
    )
    height.set_title("height error, mm")
    height.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1)
    sigma.set_title("σ̂ z, m/s (MPC-L1 only: a PID has none)")
    sigma.set_xlabel("time since the trajectory's start, s")
    _draw_means(figure.add_subplot(grid[:, 1]), load)
    return figure


def _flown(results: PaperResults, controller: str) -> bool:
    step = results.changing_dynamics.load.get(controller)
    return step is not None and len(step.times_s) > 0


def _draw_sigma(axes: Axes, step: LoadStep, colour: str) -> None:
    """As it is, pale, and its recent mean; nothing of a controller that has no σ̂."""
    if not np.isfinite(step.sigma_hat_z).all():
        return
    axes.plot(*thin(step.times_s, step.sigma_hat_z), color=colour, lw=0.6, alpha=0.3)
    mean = smooth(step.times_s, step.sigma_hat_z, _WINDOW_S)
    axes.plot(*thin(step.times_s, mean), color=colour, lw=1.5)


def _draw_means(axes: Axes, load: dict[str, LoadStep]) -> None:
    draw_bars(
        axes,
        ["2 s after\nthe load", "settled", "settled,\nno load"],
        [
            Series(
                name_of(name),
                COLOURS[name],
                [bar_of(s, _MM) for s in (step.shortly_after, step.settled, step.settled_without)],
            )
            for name, step in load.items()
        ],
    )
    axes.set_title("mean error, mm")
