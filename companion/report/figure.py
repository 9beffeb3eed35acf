"""The picture of a flight: `track.png`."""

from pathlib import Path
from typing import Any

import numpy as np

from companion.report.flight_data import FlightData
from companion.report.metrics import reported_error, true_error

_AXIS_COLOURS = ("#c0392b", "#27ae60", "#2471a3")
_DESIRED, _FLOWN = "#999999", "#1f4e79"


def draw_flight(data: FlightData, scored_s: tuple[float, float], title: str, path: Path) -> None:
    """Draw path, error, tilt and thrust, ỹ and σ̂, and computing time.

    Args:
        data: of the flight.
        scored_s: autopilot's times between which tracking is scored; t = 0 is the first.
        title: of the picture.
        path: of the PNG.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 8.5), layout="constrained")
    figure.suptitle(title, fontsize=13)
    grid = figure.add_gridspec(3, 4)
    start = scored_s[0]
    ticks = data.ticks
    time = ticks.time_s - start
    scored = (ticks.time_s >= scored_s[0]) & (ticks.time_s <= scored_s[1])

    _draw_path(figure.add_subplot(grid[0:2, 0:2], projection="3d"), data, scored_s)

    error_axes = figure.add_subplot(grid[0, 2:4])
    whole = (ticks.time_s[0], ticks.time_s[-1])
    true_times, true = true_error(data, whole)
    reported_times, reported = reported_error(data, whole)
    if len(true):
        error_axes.plot(true_times - start, true * 1e3, color=_FLOWN, label="against truth")
    error_axes.plot(
        reported_times - start, reported * 1e3, color="#e67e22", lw=0.7, label="as reported"
    )
    error_axes.set_ylabel("tracking error, mm")
    error_axes.legend(loc="upper right", fontsize=8)

    tilt_axes = figure.add_subplot(grid[1, 2:4])
    tilt_axes.plot(time, np.degrees(ticks.roll_rad), color=_AXIS_COLOURS[1], lw=0.8, label="roll")
    tilt_axes.plot(time, np.degrees(ticks.pitch_rad), color=_AXIS_COLOURS[0], lw=0.8, label="pitch")
    tilt_axes.set_ylabel("commanded tilt, °")
    thrust_axes = tilt_axes.twinx()
    thrust_axes.plot(time, ticks.thrust, color="#7f8c8d", lw=0.7)
    thrust_axes.plot(time, ticks.hover_thrust, color="k", lw=0.8, ls="--")
    thrust_axes.set_ylabel("thrust, hover estimate (dashed)")
    tilt_axes.legend(loc="upper right", fontsize=8)

    y_axes = figure.add_subplot(grid[2, 0])
    sigma_axes = figure.add_subplot(grid[2, 1])
    for k, name in enumerate("xyz"):
        style: dict[str, Any] = {"color": _AXIS_COLOURS[k], "lw": 0.8, "label": name}
        y_axes.plot(time, ticks.y_tilde_m_s[:, k] * 1e3, **style)
        sigma_axes.plot(time, ticks.sigma_hat[:, k], **style)
    y_axes.set_ylabel("ỹ (velocity prediction error), mm/s")
    sigma_axes.set_ylabel("σ̂ (adaptive estimate)")
    y_axes.legend(loc="upper right", fontsize=8)

    solve_axes = figure.add_subplot(grid[2, 2:4])
    planned = ticks.planned
    solve_axes.semilogy(
        time[~planned], ticks.computed_us[~planned], ".", ms=1.5, color="#95a5a6", label="inner"
    )
    solve_axes.semilogy(
        time[planned], ticks.computed_us[planned], ".", ms=2, color=_FLOWN, label="inner and MPC"
    )
    solve_axes.set_ylabel("computing time of a tick, µs")
    solve_axes.legend(loc="upper right", fontsize=8)

    for axes in (error_axes, tilt_axes, y_axes, sigma_axes, solve_axes):
        axes.set_xlabel("time since the trajectory's start, s")
        axes.axvspan(0.0, scored_s[1] - start, color="#f4f6f7", zorder=-5)
        axes.grid(alpha=0.3)
    if scored.any() and len(true):
        inside = (true_times >= scored_s[0]) & (true_times <= scored_s[1])
        mean = float(true[inside].mean()) * 1e3
        error_axes.axhline(mean, color="k", lw=0.8, ls=":")
        error_axes.set_title(f"mean while scored: {mean:.1f} mm", fontsize=9)
    figure.savefig(path, dpi=110)


def _draw_path(axes: Any, data: FlightData, scored_s: tuple[float, float]) -> None:  # noqa: ANN401
    """Desired and flown path while scored, drawn to one scale."""
    ticks, truth = data.ticks, data.truth
    scored = (ticks.time_s >= scored_s[0]) & (ticks.time_s <= scored_s[1])
    desired = ticks.desired_enu_m[scored]
    flown = ticks.position_enu_m[scored]
    label = "flown (as reported)"
    true = (truth.time_s >= scored_s[0]) & (truth.time_s <= scored_s[1])
    if true.any():
        flown, label = truth.position_enu_m[true], "flown (true)"
    if len(desired):
        axes.plot(*desired.T, color=_DESIRED, lw=3.0, label="desired")
        axes.plot(*flown.T, color=_FLOWN, lw=1.2, label=label)
        both = np.vstack([desired, flown])
        centre = (both.max(axis=0) + both.min(axis=0)) / 2
        reach = float((both.max(axis=0) - both.min(axis=0)).max()) / 2 * 1.05
        axes.set(
            xlim=(centre[0] - reach, centre[0] + reach),
            ylim=(centre[1] - reach, centre[1] + reach),
            zlim=(centre[2] - reach, centre[2] + reach),
        )
        axes.legend(loc="upper left", fontsize=8)
    axes.set(xlabel="x east, m", ylabel="y north, m", zlabel="z up, m")
