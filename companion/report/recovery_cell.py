"""A controller's flights through one sudden event, as figures."""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from companion.report.recovery import Recovery


@dataclass(frozen=True, slots=True)
class RecoveryCell:
    """A controller's flights through one event under one perturbation."""

    controller: str
    """Its label."""
    wind: str
    perturbation: str
    event: str
    """In words."""
    flown: int
    """Flights that were flown; one that was lost before the event has no figures."""
    peak_height_m: float
    """Greatest of the flights."""
    peak_horizontal_m: float
    """Greatest of the flights."""
    recovery_s: float
    """Median of the flights; infinite if half of them are not back."""
    longest_recovery_s: float
    """Of all flights; infinite if one is not back."""
    not_back: int
    """Flights that are not back before the end, failed, or have no figures."""


def recovery_cell(
    place: tuple[str, str, str], event: str, flown: int, flights: Sequence[Recovery]
) -> RecoveryCell:
    """The figures of flights.

    Args:
        place: label of the controller, wind and perturbation.
        event: in words.
        flown: how many there are.
        flights: of those that came as far as the event, and there is at least one.
    """
    times_s = [flight.recovery_s for flight in flights]
    times_s += [math.inf] * (flown - len(flights))
    return RecoveryCell(
        *place,
        event,
        flown,
        max(flight.peak_height_m for flight in flights),
        max(flight.peak_horizontal_m for flight in flights),
        statistics.median_high(times_s),
        max(times_s),
        sum(not math.isfinite(time_s) for time_s in times_s),
    )
