"""The in-flight monitor's gauges over time, and who flew."""

from typing import Any

import numpy as np

from companion.report.flight_data import FlightData

_LOOKS = (
    ("|ỹ|", "#8e44ad"),
    ("|σ̂|", "#1e8449"),
    ("slew", "#1f4e79"),
    ("delay", "#909497"),
)
_TOP = 2.2
"""What is far above its bound is cut off: that it is above is what counts."""
_LEAST_TOP = 1.15


def draw_monitor(axes: Any, data: FlightData, origin_s: float) -> None:  # noqa: ANN401
    """Draw each gauge over its bound, the bound, and each hand-over.

    Args:
        axes: of matplotlib.
        data: of the flight; its ticks were watched.
        origin_s: autopilot's time that is 0 in the plot.
    """
    watched = data.ticks.watched
    assert watched is not None
    times = data.ticks.time_s - origin_s
    for k, (name, colour) in enumerate(_LOOKS):
        gauge = watched.gauges[:, k]
        if np.isfinite(gauge).any():
            axes.plot(times, gauge, color=colour, lw=1.0, label=name)
    axes.axhline(1.0, color="k", lw=0.9, ls="--", label="bound")
    known = watched.gauges[np.isfinite(watched.gauges)]
    highest = float(known.max()) if len(known) else 0.0
    top = min(_TOP, max(_LEAST_TOP, 1.1 * highest))
    axes.set_ylim(0.0, top)
    flies = watched.controller != ""
    names, when = watched.controller[flies], times[flies]
    changes = np.flatnonzero(names[1:] != names[:-1]) + 1
    for row, k in enumerate(changes.tolist()):
        axes.axvline(when[k], color="#c0392b", lw=1.0)
        axes.text(
            when[k],
            (0.92 - 0.12 * (row % 3)) * top,
            f" {names[k]}",
            fontsize=8,
            color="#c0392b",
            va="top",
            clip_on=True,
            bbox={"facecolor": "white", "alpha": 0.7, "lw": 0, "pad": 0.5},
        )
