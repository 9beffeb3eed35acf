"""The picture of a flight: `track.png`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from companion.report.figure_monitor import draw_monitor
from companion.report.figure_path import draw_path
from companion.report.figure_phases import mark_events, name_phases, phases
from companion.report.flight_data import Array, FlightData
from companion.report.metrics import reported_error, true_error

_AXIS_COLOURS = ("#c0392b", "#27ae60", "#2471a3")
_FLOWN, _WIND, _TROUBLE = "#1f4e79", "#e59866", "#c0392b"
_PLAN_LOOKS = {
    "closed_form": (_FLOWN, "MPC, closed form"),
    "solved": ("#8e44ad", "MPC, constraint active (QP)"),
    "fallback": (_TROUBLE, "MPC, fallback plan"),
}
_SMOOTH_TICKS = 25
"""Samples of the moving average of ỹ, and of the range that is drawn under it."""

Axes = Any
"""matplotlib's; it is imported only when something is drawn."""


@dataclass(frozen=True, slots=True)
class _Span:
    """The scored part of a flight; plots count time from its start."""

    begin_s: float
    end_s: float

    @property
    def length_s(self) -> float:
        return self.end_s - self.begin_s

    def contains(self, times_s: Array) -> np.ndarray:
        inside: np.ndarray = (times_s >= self.begin_s) & (times_s <= self.end_s)
        return inside


def draw_flight(
    data: FlightData,
    scored_s: tuple[float, float],
    title: str,
    path: Path,
    tilt_limit_deg: float | None = None,
) -> None:
    """Draw path, error, tilt, thrust, ỹ and σ̂, the monitor's gauges, and computing time.

    Args:
        data: of the flight.
        scored_s: autopilot's times between which tracking is scored; t = 0 is the first.
        title: of the picture.
        path: of the PNG.
        tilt_limit_deg: of the vehicle, drawn if it is known.

    Raises:
        OSError: the file can't be written.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib.figure import Figure

    span = _Span(*scored_s)
    watched = data.ticks.watched is not None
    figure = Figure(figsize=(13.5, 11.5 if watched else 9.5))
    figure.suptitle(title, fontsize=13, x=0.05, y=0.985, ha="left")
    last = 4 if watched else 3
    """Number of the last row; the path takes those of the left column but two."""
    grid = figure.add_gridspec(
        last + 1, 2, left=0.05, right=0.945, bottom=0.055, top=0.925, hspace=0.42, wspace=0.14
    )
    path_axes = figure.add_subplot(grid[0 : last - 1, 0], projection="3d")
    draw_path(path_axes, data, scored_s)
    if watched:  # high enough to be as wide as its column: room for its labels
        box = path_axes.get_position()
        path_axes.set_position((box.x0, box.y0, 0.88 * box.width, box.height))
    rows: list[Axes] = [figure.add_subplot(grid[last - 1, 0])]
    right = [grid[row, 1] for row in range(last + 1)]
    rows += [figure.add_subplot(place, sharex=rows[0]) for place in (grid[last, 0], *right)]
    y_tilde, sigma, error, tilt, thrust, *monitor, computing = rows
    for axes in rows:
        _prepare(axes, data, span)
    for axes in monitor:
        draw_monitor(axes, data, span.begin_s)
        _caption(axes, "monitor: each over its bound", columns=5)
    _draw_adaptation(y_tilde, sigma, data, span)
    _draw_error(error, data, span)
    _draw_tilt(tilt, data, span, tilt_limit_deg)
    _draw_thrust(thrust, data, span)
    _draw_computing(computing, data, span)
    for axes in (sigma, computing):
        axes.set_xlabel("time since the trajectory's start, s", fontsize=9)
    figure.savefig(path, dpi=110)


def _prepare(axes: Axes, data: FlightData, span: _Span) -> None:
    """Grid, scored part shaded, and what was flown on a fallback in red."""
    axes.grid(alpha=0.3)
    axes.tick_params(labelsize=8)
    axes.axvspan(0.0, span.length_s, color="#f1f4f6", zorder=-5)
    times = data.ticks.time_s
    if len(times) > 1:
        axes.set_xlim(times[0] - span.begin_s, times[-1] - span.begin_s)
    for begin, _, _ in phases(data):
        axes.axvline(begin - span.begin_s, color="#808b96", lw=0.7, ls=":", zorder=0.5)
    mark_events(axes, data, span.begin_s)
    for begin, end in _stretches(times, data.ticks.on_fallback):
        axes.axvspan(begin - span.begin_s, end - span.begin_s, color="#f5b7b1", zorder=-4)


def _stretches(times_s: Array, marked: np.ndarray) -> list[tuple[float, float]]:
    """First and last time of each run of marked samples."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], marked.astype(int), [0]))))
    return [
        (float(times_s[a]), float(times_s[min(b, len(times_s) - 1)]))
        for a, b in zip(edges[::2], edges[1::2], strict=True)
    ]


def _caption(axes: Axes, text: str, columns: int = 4) -> None:
    """Say what and in which unit, and put the legend beside it, where no data are."""
    axes.set_title(text, fontsize=9, loc="left")
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        legend = axes.legend(
            handles,
            labels,
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            ncols=columns,
            fontsize=8,
            frameon=False,
            borderaxespad=0.1,
            handlelength=1.4,
            columnspacing=1.0,
        )
        for handle in legend.legend_handles:
            if hasattr(handle, "set_markersize"):
                handle.set_markersize(6)


def _draw_error(axes: Axes, data: FlightData, span: _Span) -> None:
    """The approach may go off the scale: it is that of the scored part."""
    whole = (data.ticks.time_s[0], data.ticks.time_s[-1]) if len(data.ticks.time_s) else (0.0, 0.0)
    times, reported = reported_error(data, whole)
    axes.plot(times - span.begin_s, reported * 1e3, color="#e67e22", lw=0.7, label="as reported")
    best_times, best = true_error(data, whole)
    if len(best):
        axes.plot(best_times - span.begin_s, best * 1e3, color=_FLOWN, label="true")
    else:
        best_times, best = times, reported
    inside = best[span.contains(best_times)] * 1e3
    text = "tracking error, mm"
    if len(inside):
        axes.axhline(inside.mean(), color="k", lw=0.9, ls=":", label="mean while scored")
        axes.set_ylim(0.0, 1.15 * inside.max())
        text += f" (mean {inside.mean():.1f}, max {inside.max():.1f})"
    wind = data.truth.wind_acceleration_m_s2
    if len(wind) and wind.max() > 0.0:
        side = axes.twinx()
        side.fill_between(
            data.truth.wind_time_s - span.begin_s, wind, color=_WIND, alpha=0.35, lw=0
        )
        side.set_ylim(0.0, 3.0 * float(wind.max()))
        side.set_ylabel("wind push, m/s²", fontsize=8, color=_WIND, loc="bottom")
        side.tick_params(labelsize=7, labelcolor=_WIND)
    _caption(axes, text)


def _draw_tilt(axes: Axes, data: FlightData, span: _Span, limit_deg: float | None) -> None:
    ticks = data.ticks
    time = ticks.time_s - span.begin_s
    axes.plot(time, np.degrees(ticks.roll_rad), color=_AXIS_COLOURS[1], lw=0.9, label="roll")
    axes.plot(time, np.degrees(ticks.pitch_rad), color=_AXIS_COLOURS[0], lw=0.9, label="pitch")
    if limit_deg is not None:
        for sign, label in ((1.0, "vehicle's limit"), (-1.0, None)):
            axes.axhline(sign * limit_deg, color="k", lw=0.9, ls="--", label=label)
    tilts = np.degrees(np.abs(np.concatenate([ticks.roll_rad, ticks.pitch_rad])))
    reach = max([limit_deg or 1.0, *tilts[np.isfinite(tilts)].tolist()])
    axes.set_ylim(-1.5 * reach, 1.2 * reach)  # room below for the names of the phases
    name_phases(axes, data, span.begin_s)
    _caption(axes, "commanded tilt, °")


def _draw_thrust(axes: Axes, data: FlightData, span: _Span) -> None:
    ticks = data.ticks
    time = ticks.time_s - span.begin_s
    axes.plot(time, ticks.thrust, color="#7f8c8d", lw=0.6, label="setpoint")
    axes.plot(time, ticks.hover_thrust, color="k", lw=1.1, label="estimated for hover")
    _caption(axes, "thrust field, 0 … 1")


def _draw_adaptation(y_tilde: Axes, sigma: Axes, data: FlightData, span: _Span) -> None:
    ticks = data.ticks
    time = ticks.time_s - span.begin_s
    for k, name in enumerate("xyz"):
        colour = _AXIS_COLOURS[k]
        noisy = ticks.y_tilde_m_s[:, k] * 1e3
        y_tilde.fill_between(*_envelope(time, noisy), color=colour, alpha=0.18, lw=0)
        y_tilde.plot(time, _smooth(noisy), color=colour, lw=1.1, label=name)
        sigma.plot(time, ticks.sigma_hat[:, k], color=colour, lw=0.9, label=name)
    known = np.abs(ticks.y_tilde_m_s[span.contains(ticks.time_s)] * 1e3)
    known = known[np.isfinite(known)]
    if len(known):
        reach = 1.1 * max(1.0, float(np.percentile(known, 99.5)))
        y_tilde.set_ylim(-reach, reach)
    _caption(y_tilde, "ỹ: error of the predicted velocity, mm/s (mean and range of 0.25 s)")
    _caption(sigma, "σ̂: adaptive estimate, in the units of u (x, y: –, z: m/s)")


def _envelope(times_s: Array, values: Array) -> tuple[Array, Array, Array]:
    """Middle, least and greatest of each few samples; those with a missing value are left out."""
    count = len(values) // _SMOOTH_TICKS * _SMOOTH_TICKS
    blocks = values[:count].reshape(-1, _SMOOTH_TICKS)
    middles = times_s[:count].reshape(-1, _SMOOTH_TICKS)[:, _SMOOTH_TICKS // 2]
    return middles, blocks.min(axis=1), blocks.max(axis=1)


def _smooth(values: Array) -> Array:
    """Moving average that leaves missing values out."""
    if not len(values):
        return values
    known = np.isfinite(values)
    window = np.ones(min(_SMOOTH_TICKS, len(values)))
    total = np.convolve(np.where(known, values, 0.0), window, mode="same")
    count = np.convolve(known.astype(float), window, mode="same")
    missing = np.full(len(values), np.nan)
    mean: Array = np.divide(total, count, out=missing, where=known & (count > 0))
    return mean


def _draw_computing(axes: Axes, data: FlightData, span: _Span) -> None:
    ticks = data.ticks
    time = ticks.time_s - span.begin_s
    timed = ticks.computed_us > 0.0  # not so where nothing was computed; the scale has no 0
    inner = timed & (ticks.plan == "")
    axes.semilogy(
        time[inner], ticks.computed_us[inner], ".", ms=1.5, color="#95a5a6", label="L1 only"
    )
    fallback = np.isin(ticks.plan, ("shifted_plan", "clipped_closed_form"))
    kinds = {
        "closed_form": ticks.plan == "closed_form",
        "solved": ticks.plan == "solved",
        "fallback": fallback,
    }
    for kind, use in kinds.items():
        colour, label = _PLAN_LOOKS[kind]
        use = use & timed
        if use.any():
            axes.semilogy(time[use], ticks.computed_us[use], ".", ms=2, color=colour, label=label)
    _caption(axes, "computing time of a tick, µs")
