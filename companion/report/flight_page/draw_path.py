"""The path from above and, below it, from the side, on one axis towards east."""

import numpy as np
from matplotlib.figure import Figure

from companion.report.flight_data import Array
from companion.report.flight_page.drawing import BLOWS, FLOWN, FOUND, TROUBLE, WIDTH_IN, Scene
from companion.report.pages.style import MUTED, SMALL

_POINTS = 600


def draw_path(scene: Scene) -> Figure:
    """Desired and flown path, the start, where it blew, and the largest error."""
    ticks, truth = scene.story.data.ticks, scene.story.data.truth
    desired = _known(ticks.desired_enu_m[scene.scored(ticks.time_s)])
    times, flown = ticks.time_s, ticks.position_enu_m
    inside = scene.scored(truth.time_s)
    if inside.any():
        times, flown = truth.time_s, truth.position_enu_m
    use = scene.scored(times) & np.isfinite(flown).all(axis=1)
    times, flown = times[use], flown[use]
    points = np.vstack([desired, flown])
    low, high = points.min(axis=0), points.max(axis=0)
    # A path along a line has room for it, too.
    size = np.maximum(high - low, 0.3 * float((high - low).max(initial=0.5))) * 1.1
    middle = (low + high) / 2
    inner_in = WIDTH_IN * 0.86
    scale = min(inner_in / size[0], 4.6 / size[1], 3.0 / size[2])
    above_in, side_in = size[1] * scale, size[2] * scale
    height = above_in + side_in + 1.25
    figure = Figure(figsize=(WIDTH_IN, height))
    left = (0.105 * WIDTH_IN + max(0.0, (inner_in - size[0] * scale) / 2)) / WIDTH_IN
    width = size[0] * scale / WIDTH_IN
    above = figure.add_axes((left, (side_in + 0.95) / height, width, above_in / height))
    side = figure.add_axes((left, 0.48 / height, width, side_in / height), sharex=above)
    windy = _windy(scene, times)
    for axes, k in ((above, 1), (side, 2)):
        if windy.any():
            marked = np.where(windy[:, None], flown, np.nan)
            axes.plot(*_thinned(marked)[:, [0, k]].T, color=BLOWS, lw=5.0, alpha=0.4,
                      solid_capstyle="butt", label="wind above half its peak")  # fmt: skip
        axes.plot(*_thinned(flown)[:, [0, k]].T, color=FLOWN, lw=1.4, label="flown")
        axes.plot(*_thinned(desired)[:, [0, k]].T, color=MUTED, lw=1.2, ls=(0, (4, 2)),
                  label="desired")  # fmt: skip
        axes.plot(*flown[:1, [0, k]].T, "o", ms=5, color=FOUND, label="start")
        if scene.peak is not None and len(times):
            worst = flown[int(np.argmin(np.abs(times - scene.peak.at_s)))]
            axes.plot([worst[0]], [worst[k]], "o", ms=5, color=TROUBLE, label="largest error")
        axes.set_xlim(middle[0] - size[0] / 2, middle[0] + size[0] / 2)
        axes.set_ylim(middle[k] - size[k] / 2, middle[k] + size[k] / 2)
        axes.locator_params(axis="x", nbins=_ticks(size[0] * scale))
        axes.locator_params(axis="y", nbins=_ticks(size[k] * scale))
    above.tick_params(labelbottom=False)
    above.set_ylabel("north, m")
    side.set_ylabel("up, m")
    side.set_xlabel("east, m")
    handles, labels = above.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="upper left", ncols=5, fontsize=SMALL - 0.5, handlelength=1.3,
        columnspacing=0.9, handletextpad=0.4, borderaxespad=0.2,
    )  # fmt: skip
    return figure


def _ticks(length_in: float) -> int:
    """How many steps an axis of this length has room for."""
    return int(min(6, max(1, round(1.7 * length_in))))


def _known(points_m: Array) -> Array:
    return points_m[np.isfinite(points_m).all(axis=1)]


def _thinned(points_m: Array) -> Array:
    return points_m[:: max(1, len(points_m) // _POINTS)]


def _windy(scene: Scene, times_s: Array) -> np.ndarray:
    """Where a local wind (a fan's jet) blows; nowhere if it is everywhere or unknown."""
    truth = scene.story.data.truth
    if len(truth.wind_time_s) < 2 or not len(times_s):
        return np.zeros(len(times_s), dtype=bool)
    wind = np.interp(times_s, truth.wind_time_s, truth.wind_acceleration_m_s2)
    peak = float(wind.max())
    if peak <= 0.0 or peak < 2.0 * float(wind.mean()):
        return np.zeros(len(times_s), dtype=bool)
    strong: np.ndarray = wind > 0.5 * peak
    return strong
