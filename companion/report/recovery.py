"""How a flight recovers from a sudden event: the peak of its error, and the time until it is over.

The error is position minus desired position, height and horizontal distance each for itself.  What
it was before the event is its greatest value over the scored part before it; it is *back* when both
are no larger than that by more than a margin, and stay so for three seconds at least.  (Not to the
end: in a wind that stays, a hard turn late in a trajectory may be tracked worse than in calm air,
which is an error of tracking, and no part of the recovery.)  Whoever is lost later has not
recovered: it is not back if the flight failed, if the record does not reach to the end of the
scored part, or if the error is outside all through the last three seconds.
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from companion.mavlink.truth_events import TruthEvent
from companion.report.flight_data import Array, FlightData
from companion.report.metrics import event_while_scored, reported_error_enu, true_error_enu

GOOD = ("tracked", "landed")
"""Outcomes of flights that were not lost."""
MARGIN_M = 0.03
"""Beyond the greatest error before the event."""
STAYS_S = 3.0
"""An error that is back for less, is not back."""
_PASSES_S = 0.5
"""An error that swings through its bounds in less is not within them, at the end of the record."""
_SHORT_S = 0.5
"""By this much a record may end before the scored part does."""


@dataclass(frozen=True, slots=True)
class Recovery:
    """From one event; lengths in m, times in s."""

    event_s: float
    """By the clock of the times that were given."""
    peak_height_m: float
    """Greatest height error, up or down, from the event to the end of the scored part."""
    peak_horizontal_m: float
    """Greatest horizontal error from the event to the end of the scored part."""
    before_height_m: float
    """Greatest height error before the event."""
    before_horizontal_m: float
    """Greatest horizontal error before the event."""
    recovery_s: float
    """From the event until the error is back for good; 0 if it did not leave, infinite if it is
    not back before the end."""

    @property
    def is_back(self) -> bool:
        """Whether the error came back at all."""
        return math.isfinite(self.recovery_s)


def recovery(
    times_s: Array,
    error_enu_m: Array,
    event_s: float,
    margin_m: float = MARGIN_M,
    *,
    end_s: float | None = None,
    lost: bool = False,
) -> Recovery | None:
    """Figures of one event.

    Args:
        times_s: (n,) of the scored part, rising.
        error_enu_m: (n, 3) position minus desired position; rows that are not finite are left out.
        event_s: when it happened.
        margin_m: by how much the error may be larger than before and still be back.
        end_s: of the scored part, if the times need not reach so far.
        lost: the flight failed, at whatever time: it is not back.

    Returns:
        None if there is nothing before the event or nothing after it.
    """
    known = np.isfinite(error_enu_m).all(axis=1)
    times, error = times_s[known], error_enu_m[known]
    height = np.abs(error[:, 2])
    horizontal = np.hypot(error[:, 0], error[:, 1])
    before = times < event_s
    if not before.any() or before.all():
        return None
    height_before, horizontal_before = float(height[before].max()), float(horizontal[before].max())
    after = ~before
    off = (height > height_before + margin_m) | (horizontal > horizontal_before + margin_m)
    unknown = lost or (end_s is not None and float(times[-1]) < end_s - _SHORT_S)
    return Recovery(
        event_s=event_s,
        peak_height_m=float(height[after].max()),
        peak_horizontal_m=float(horizontal[after].max()),
        before_height_m=height_before,
        before_horizontal_m=horizontal_before,
        recovery_s=math.inf if unknown else _back_after(times[after] - event_s, off[after]),
    )


def _back_after(since_s: Array, off: np.ndarray) -> float:
    """When the first stretch begins that is within bounds for long enough.

    Args:
        since_s: (n,) times since the event.
        off: (n,) whether the error is too large.
    """
    end_s = float(since_s[-1])
    leaves = [0.0, *since_s[off].tolist(), end_s]
    within_to_s = [again for left, again in pairwise(leaves) if again - left >= _PASSES_S]
    if not within_to_s or within_to_s[-1] < end_s - STAYS_S + _PASSES_S:
        return math.inf
    for left, again in pairwise(leaves):
        if again - left >= STAYS_S:
            return float(left)
    return math.inf


def flight_recovery(
    data: FlightData,
    scored_s: tuple[float, float],
    *,
    against_truth: bool = True,
    lost: bool = False,
) -> tuple[TruthEvent, Recovery] | None:
    """The first event of a flight's scored part, and its figures; None without one.

    Args:
        data: of the flight.
        scored_s: autopilot's times between which tracking is scored.
        against_truth: against the true position; else against the reported one.
        lost: the flight failed.
    """
    event = event_while_scored(data.truth.events, scored_s)
    if event is None:
        return None
    errors = true_error_enu if against_truth else reported_error_enu
    found = recovery(*errors(data, scored_s), event.time_s, end_s=scored_s[1], lost=lost)
    return None if found is None else (event, found)


def event_object(
    data: FlightData, scored_s: tuple[float, float], *, lost: bool = False
) -> dict[str, Any] | None:
    """The first event of a flight's scored part for `result.json`; None without one.

    Args:
        data: of the flight.
        scored_s: autopilot's times between which tracking is scored.
        lost: the flight failed.
    """
    found = flight_recovery(data, scored_s, lost=lost)
    if found is None:
        return None
    event, figures = found
    return {
        "what": event.text,
        "at_s": round(event.time_s - scored_s[0], 3),
        "peak_height_error_m": round(figures.peak_height_m, 5),
        "peak_horizontal_error_m": round(figures.peak_horizontal_m, 5),
        "recovery_s": round(figures.recovery_s, 2) if figures.is_back else None,
    }
