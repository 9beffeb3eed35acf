"""Mean and spread over seeds."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


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
