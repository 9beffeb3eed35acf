"""The flown path in three dimensions, beside the desired one."""

from typing import Any

import numpy as np

from companion.report.flight_data import Array, FlightData

_DESIRED, _FLOWN, _WIND, _START = "#a6acaf", "#1f4e79", "#e67e22", "#1e8449"
_SMALLEST_SHARE = 0.45
"""The shortest axis is at least this share of the longest, so that a flat path has room."""
_SPREAD_FACTOR = 2.0
"""A wind whose peak exceeds its mean by less is everywhere: no place on the path is marked."""


def draw_path(axes: Any, data: FlightData, scored_s: tuple[float, float]) -> None:  # noqa: ANN401
    """Desired and flown path while scored, to one scale, with shadow, start and place of the wind.

    Args:
        axes: three-dimensional, of matplotlib.
        data: of the flight.
        scored_s: autopilot's times between which tracking is scored.
    """
    ticks, truth = data.ticks, data.truth
    desired = ticks.desired_enu_m[_within(ticks.time_s, scored_s)]
    desired = desired[np.isfinite(desired).all(axis=1)]
    times, flown, label = ticks.time_s, ticks.position_enu_m, "flown (as reported)"
    if _within(truth.time_s, scored_s).any():
        times, flown, label = truth.time_s, truth.position_enu_m, "flown (true)"
    use = _within(times, scored_s) & np.isfinite(flown).all(axis=1)
    times, flown = times[use], flown[use]
    axes.set_xlabel("x east, m", fontsize=9)
    axes.set_ylabel("y north, m", fontsize=9)
    axes.set_zlabel("z up, m", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.locator_params(nbins=5)
    if not len(desired) or not len(flown):
        return
    floor = _set_limits(axes, np.vstack([desired, flown]))
    axes.plot(desired[:, 0], desired[:, 1], floor, color="#d5d8dc", lw=1.5)
    axes.plot(*desired.T, color=_DESIRED, lw=3.5, label="desired")
    windy = _windy(data, times)
    if windy.any():
        marked = np.where(windy[:, None], flown, np.nan)
        axes.plot(*marked.T, color=_WIND, lw=4.0, alpha=0.6, label="wind above half its peak")
    axes.plot(*flown.T, color=_FLOWN, lw=1.3, label=label)
    axes.plot(*desired[:1].T, "o", color=_START, ms=6, label="start")
    axes.view_init(elev=26.0, azim=-58.0)
    axes.legend(loc="upper left", bbox_to_anchor=(-0.1, 1.04), fontsize=8, ncols=4, frameon=False)


def _set_limits(axes: Any, points_m: Array) -> float:  # noqa: ANN401
    """One scale on all axes; the height of the floor."""
    low, high = points_m.min(axis=0), points_m.max(axis=0)
    size = np.maximum(high - low, 1e-3)
    size = np.maximum(size, _SMALLEST_SHARE * size.max()) * 1.08
    middle = (low + high) / 2
    low, high = middle - size / 2, middle + size / 2
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(size / size.max(), zoom=1.12)
    return float(low[2])


def _windy(data: FlightData, times_s: Array) -> np.ndarray:
    """Where a local wind (a fan's jet) blows; nowhere if the wind is everywhere or unknown."""
    truth = data.truth
    if len(truth.wind_time_s) < 2:
        return np.zeros(len(times_s), dtype=bool)
    wind = np.interp(times_s, truth.wind_time_s, truth.wind_acceleration_m_s2)
    peak = float(wind.max())
    if peak < _SPREAD_FACTOR * float(wind.mean()):
        return np.zeros(len(times_s), dtype=bool)
    strong: np.ndarray = wind > 0.5 * peak
    return strong


def _within(times_s: Array, interval_s: tuple[float, float]) -> np.ndarray:
    inside: np.ndarray = (times_s >= interval_s[0]) & (times_s <= interval_s[1])
    return inside
