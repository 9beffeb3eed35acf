"""Mean and spread over seeds."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_MM = 1e3


@dataclass(frozen=True, slots=True)
class Spread:
    """Of one figure over the seeds."""

    mean: float
    """Infinite if one of the flights was lost."""
    std: float
    """Of the sample (n - 1); NaN for a single seed, of which no spread is claimed."""
    seeds: int
    lost: int
    """Flights that did not come to the end of the trajectory."""
    values: tuple[float, ...]


def spread(values: Sequence[float]) -> Spread:
    """Mean and spread of values, of which those that are not finite are lost flights."""
    lost = sum(not math.isfinite(value) for value in values)
    if lost or not values:
        return Spread(math.inf, math.nan, len(values), lost, tuple(values))
    std = float(np.std(values, ddof=1)) if len(values) > 1 else math.nan
    return Spread(float(np.mean(values)), std, len(values), 0, tuple(values))


def millimetres(spread: Spread, unit: str = "") -> str:
    """A spread of lengths in metres for a person, in millimetres.

    Args:
        spread: m.
        unit: put behind the figure, if there is one: " mm" in a sentence, nothing in a table whose
            head says it.

    Returns:
        Mean ± standard deviation; the mean alone for a single seed; how many flights were lost.
    """
    if not math.isfinite(spread.mean):
        return lost_text(spread)
    text = f"{spread.mean * _MM:.1f}"
    if math.isfinite(spread.std):
        text = f"{text} ± {spread.std * _MM:.1f}"
    return text + unit


def lost_text(spread: Spread) -> str:
    """How many flights did not come to the end; a dash if there was none at all."""
    if not spread.seeds:
        return "–"
    return "lost" if spread.seeds == 1 else f"lost {spread.lost} of {spread.seeds}"
