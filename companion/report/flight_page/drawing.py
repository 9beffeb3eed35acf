"""What all figures of a flight have in common: the time axis, phases, marks."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.report.flight_data import Array
from companion.report.flight_page.answer import Peak
from companion.report.flight_page.findings import Limits
from companion.report.flight_page.story import Story
from companion.report.pages.style import FAINT, INK, L1, LQR_L1, MPC_L1, MPC_PID, MUTED, SMALL, WIND

FLOWN, TROUBLE, FOUND = MPC_PID, MPC_L1, LQR_L1
BLOWS, OTHER = WIND, L1
AXIS_COLOURS = (MPC_L1, LQR_L1, MPC_PID)
WIDTH_IN = 5.4
_NAMED_SHARE = 0.09
_BLOCKS = 300


@dataclass(frozen=True, slots=True)
class Scene:
    """What is drawn."""

    story: Story
    scored_s: tuple[float, float] | None
    peak: Peak | None
    limits: Limits
    origin_s: float
    """Autopilot's time that is 0 on the axes."""
    time_label: str
    real_time: bool

    @property
    def times_s(self) -> Array:
        """Of the ticks, on the axes."""
        times: Array = self.story.data.ticks.time_s - self.origin_s
        return times

    def scored(self, times_s: Array) -> np.ndarray:
        """Which of the autopilot's times lie in the scored part; all, if there is none."""
        if self.scored_s is None:
            return np.ones(len(times_s), dtype=bool)
        inside: np.ndarray = (times_s >= self.scored_s[0]) & (times_s <= self.scored_s[1])
        return inside


def panels(height_in: float, rows: int, columns: int = 1, *, hspace: float = 0.3) -> list[Axes]:
    """Axes of a new figure, row by row, with one time axis."""
    figure = Figure(figsize=(WIDTH_IN, height_in))
    grid = figure.add_gridspec(
        rows,
        columns,
        left=0.105,
        right=0.975,
        bottom=0.48 / height_in,
        top=1.0 - 0.27 / height_in,
        hspace=hspace,
        wspace=0.24,
    )
    made: list[Axes] = []
    for row in range(rows):
        for column in range(columns):
            made.append(figure.add_subplot(grid[row, column], sharex=made[0] if made else None))
            if row < rows - 1:
                made[-1].tick_params(labelbottom=False)
    return made


def prepare(axes: Axes, scene: Scene, *, named: bool = False) -> None:
    """The whole flight's span, the scored part shaded, phases, fallbacks in red."""
    ticks = scene.story.data.ticks
    times = scene.times_s
    axes.margins(x=0.0)
    if len(times) > 1:
        axes.set_xlim(float(times[0]), float(times[-1]))
    if scene.scored_s is not None:
        begin, end = (t - scene.origin_s for t in scene.scored_s)
        axes.axvspan(begin, min(end, float(times[-1])), color=FAINT, alpha=0.35, lw=0, zorder=-5)
    for begin, end in stretches(times, ticks.on_fallback):
        axes.axvspan(begin, max(end, begin + 0.02), color=TROUBLE, alpha=0.3, lw=0, zorder=-4)
    for event in scene.story.data.truth.events:
        axes.axvline(event.time_s - scene.origin_s, color=BLOWS, lw=1.1, ls="-.")
    shown = _phases(scene)
    for begin, _, _ in shown:
        axes.axvline(begin, color=MUTED, lw=0.7, ls=":", zorder=0.5)
    if named and shown:
        whole = shown[-1][1] - shown[0][0]
        for begin, end, name in shown:
            if end - begin > _NAMED_SHARE * whole:
                axes.text(
                    (begin + end) / 2, 0.97, name, transform=axes.get_xaxis_transform(),
                    ha="center", va="top", fontsize=SMALL - 1, style="italic", color=MUTED,
                )  # fmt: skip


def label_time(axes: Axes, scene: Scene) -> None:
    """Below the lowest panel."""
    axes.set_xlabel(scene.time_label)


def caption(axes: Axes, text: str, columns: int = 4) -> None:
    """What and in which unit, above on the left; the legend on the right of it."""
    axes.set_title(text, pad=4)
    handles, _ = axes.get_legend_handles_labels()
    if handles:
        axes.legend(
            loc="lower right", bbox_to_anchor=(1.01, 0.985), ncols=columns, borderaxespad=0.1,
            handlelength=1.2, columnspacing=0.8, handletextpad=0.4, fontsize=SMALL - 0.5,
        )  # fmt: skip


def draw_band(axes: Axes, times_s: Array, values: Array, colour: str, label: str) -> None:
    """A noisy series as its range in short blocks of time, and the mean of each."""
    count = max(1, len(values) // _BLOCKS)
    whole = len(values) // count * count
    if not whole:
        return
    middles = times_s[:whole].reshape(-1, count)[:, count // 2]
    blocks = values[:whole].reshape(-1, count)
    known = np.asarray(np.isfinite(blocks).all(axis=1))
    mean = np.where(known, np.where(known[:, None], blocks, 0.0).mean(axis=1), np.nan)
    axes.fill_between(
        middles, blocks.min(axis=1), blocks.max(axis=1), color=colour, alpha=0.25, lw=0
    )
    axes.plot(middles, mean, color=colour, lw=1.1, label=label)


def draw_limit(axes: Axes, value: float, label: str | None) -> None:
    """A dashed line at a limit."""
    axes.axhline(value, color=INK, lw=0.9, ls=(0, (4, 2)), label=label)


def stretches(times_s: Array, marked: np.ndarray) -> list[tuple[float, float]]:
    """First and last time of each run of marked samples."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], marked.astype(int), [0]))))
    return [
        (float(times_s[a]), float(times_s[min(b, len(times_s) - 1)]))
        for a, b in zip(edges[::2], edges[1::2], strict=True)
    ]


def _phases(scene: Scene) -> list[tuple[float, float, str]]:
    """Begin, end and name of those phases in which states were flown on, on the axes."""
    times = scene.times_s
    if not len(times):
        return []
    shift = scene.story.autopilot_ahead_s - scene.origin_s
    cut = [
        (max(p.begin_s + shift, float(times[0])), min(p.end_s + shift, float(times[-1])), p.name)
        for p in scene.story.phases
    ]
    return [one for one in cut if one[1] > one[0]]
