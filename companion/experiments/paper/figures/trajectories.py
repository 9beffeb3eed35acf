"""The five test trajectories in three dimensions."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from companion.experiments.paper.figures.fans import Fan, fan_of
from companion.experiments.paper.results import PaperResults
from companion.report.flight_data import Array
from companion.report.pages.style import (
    FAINT,
    INK,
    MUTED,
    SMALL,
    WIND,
    new_figure,
    say,
)
from companion.trajectories.harmonic import TEST_TRAJECTORIES

_SMALLEST_SHARE = 0.45
"""The shortest axis is at least this share of the longest, so that a flat path has room."""
_SAMPLES = 400


def caption(_: PaperResults) -> str:
    """What is drawn."""
    return (
        "The five desired trajectories, in metres (x east, y north, z up), each to one scale over "
        "the 20 s that are scored; the dot is the start, the grey line the shadow on the floor. "
        "The orange line is the axis of the fan's jet, from the fan (square) to where it crosses "
        "the path; its profile is a Gaussian with σ = 0.4 m. From 1 to 5 they get faster and more "
        "curved; the greatest speed and acceleration stand above each."
    )


def draw(_: PaperResults) -> Figure:
    """Draw."""
    figure = new_figure(5.5)
    figure.set_layout_engine("none")
    grid = figure.add_gridspec(
        2, 3, left=0.01, right=0.97, bottom=0.0, top=1.0, wspace=0.08, hspace=0.0
    )
    for k, (number, trajectory) in enumerate(TEST_TRAJECTORIES.items()):
        axes = figure.add_subplot(grid[divmod(k, 3)], projection="3d")
        times = np.linspace(0.0, trajectory.scored_s, _SAMPLES)
        motion = trajectory.motion(times)
        _draw_path(axes, motion.position_m, fan_of(number))
        speed = np.linalg.norm(motion.velocity_m_s, axis=1).max()
        acceleration = np.linalg.norm(motion.acceleration_m_s2, axis=1).max()
        title = f"{trajectory.name}\n{speed:.1f} m/s, {acceleration:.1f} m/s²"
        axes.set_title(title, loc="center", y=0.91)
    key = figure.add_subplot(grid[1, 2])
    say(key, "")
    key.plot([], [], color=INK, lw=1.6, label="desired path")
    key.plot([], [], "o", color=INK, label="start")
    key.plot([], [], color=MUTED, lw=1.0, alpha=0.6, label="its shadow")
    key.plot([], [], color=WIND, lw=2.0, marker="s", ms=5, label="fan and its jet")
    key.legend(loc="center", fontsize=SMALL + 1)
    return figure


def _draw_path(axes: Any, path_m: Array, fan: Fan | None) -> None:  # noqa: ANN401 - 3-D axes
    shown = path_m if fan is None else np.vstack([path_m, fan.stands_m])
    low, high = shown.min(axis=0), shown.max(axis=0)
    size = np.maximum(high - low, _SMALLEST_SHARE * (high - low).max()) * 1.06
    middle = (low + high) / 2
    low, high = middle - size / 2, middle + size / 2
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(size / size.max(), zoom=0.98)
    axes.plot(path_m[:, 0], path_m[:, 1], low[2], color=MUTED, lw=1.0, alpha=0.6)
    if fan is not None:
        axes.plot(*np.stack([fan.stands_m, fan.crosses_m], axis=1), color=WIND, lw=2.0)
        axes.plot(*fan.stands_m[:, None], marker="s", color=WIND, ms=6)
    axes.plot(*path_m.T, color=INK, lw=1.6)
    axes.plot(*path_m[:1].T, marker="o", color=INK, ms=6)
    axes.view_init(elev=24.0, azim=-58.0)
    axes.locator_params(nbins=4)
    axes.tick_params(labelsize=SMALL - 1, pad=-2, color=FAINT)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((0.5, 0.5, 0.5, 0.04))
        axis.line.set_color(MUTED)
        axis._axinfo["grid"]["color"] = FAINT
    axes.set_xlabel("x", labelpad=-6, color=INK)
    axes.set_ylabel("y", labelpad=-6, color=INK)
    axes.set_zlabel("z", labelpad=-7, color=INK)
