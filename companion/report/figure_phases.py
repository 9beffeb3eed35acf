"""The phases of a flight, marked in a plot over time."""

from typing import Any

import numpy as np

from companion.report.flight_data import FlightData

_NAMED_SHARE = 0.07
"""A phase that takes less of the flight has no room for its name."""


def phases(data: FlightData) -> list[tuple[float, float, str]]:
    """Begin, end and name of each phase; ticks in silence belong to the phase around them."""
    ticks = data.ticks
    spoken = ticks.phase != "silence"
    times, names = ticks.time_s[spoken], ticks.phase[spoken]
    if not len(times):
        return []
    firsts = [0, *(np.flatnonzero(names[1:] != names[:-1]) + 1).tolist()]
    ends = [*(float(times[k]) for k in firsts[1:]), float(ticks.time_s[-1])]
    return [(float(times[k]), end, str(names[k])) for k, end in zip(firsts, ends, strict=True)]


def name_phases(axes: Any, data: FlightData, origin_s: float) -> None:  # noqa: ANN401
    """Write the names of those phases that last long enough for it."""
    found = phases(data)
    for begin, end, name in found:
        if end - begin > _NAMED_SHARE * (found[-1][1] - found[0][0]):
            middle = (begin + end) / 2 - origin_s
            axes.text(
                middle,
                0.03,
                name,
                transform=axes.get_xaxis_transform(),
                ha="center",
                fontsize=8,
                style="italic",
                color="#566573",
            )


def mark_events(axes: Any, data: FlightData, origin_s: float) -> None:  # noqa: ANN401
    """Mark what the simulation's scenario did to the vehicle, where it did."""
    for event in data.truth.events:
        axes.axvline(event.time_s - origin_s, color="#b9770e", lw=1.2, ls="-.", zorder=0.6)
