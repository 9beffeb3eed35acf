"""Shares with their intervals, and quantiles in which a lost flight is the worst there is."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.report.flight_data import Array

CONFIDENCE = 0.95
_Z = 1.959963984540054
"""Standard normal quantile of 97.5 %."""
_FEW = 20
"""Clusters below which each counts as one flight."""
QUANTILES = (0.5, 0.9, 0.99)


@dataclass(frozen=True, slots=True)
class Proportion:
    """A share of flights, with the interval that holds the true one at 95 % confidence."""

    count: int
    of: int
    share: float
    low: float
    high: float

    @property
    def rest(self) -> "Proportion":
        """Of the flights that do not have it."""
        low, high = 1.0 - self.high, 1.0 - self.low
        return Proportion(self.of - self.count, self.of, 1.0 - self.share, low, high)


def proportion(count: int, of: int, independent: float | None = None) -> Proportion:
    """Wilson's score interval: sound for few flights, and for none or all of them.

    E. B. Wilson, Probable inference, the law of succession, and statistical inference (1927).

    Args:
        count: flights that have something.
        of: flights; with none, nothing is known.
        independent: as many independent ones as tell as much; by default all are.
    """
    if of == 0:
        return Proportion(0, 0, math.nan, 0.0, 1.0)
    share, size = count / of, of if independent is None else independent
    scale = 1.0 + _Z**2 / size
    middle = (share + _Z**2 / (2.0 * size)) / scale
    half = _Z / scale * math.sqrt(share * (1.0 - share) / size + _Z**2 / (4.0 * size**2))
    low = 0.0 if count == 0 else max(0.0, middle - half)
    high = 1.0 if count == of else min(1.0, middle + half)
    return Proportion(count, of, share, low, high)


def clustered(having: NDArray[np.bool_], clusters: NDArray[np.intp]) -> Proportion:
    """The same where flights share their conditions, and so their fate.

    Wilson's interval for the effective number of flights, by how much the share differs between
    clusters (L. Kish, Survey sampling, 1965; with Wilson's: N. Dean and M. Pagano 2015).

    Args:
        having: (flights,) which have something.
        clusters: (flights,) which belong together.
    """
    count, of = int(having.sum()), len(having)
    sizes = np.unique(clusters, return_counts=True)[1]
    together = len(sizes)
    if together == of:
        return proportion(count, of)
    if together < _FEW or count in (0, of):  # how alike they are can't be seen
        return proportion(count, of, together)
    share = count / of
    codes = np.unique(clusters, return_inverse=True)[1].ravel()
    off = np.bincount(codes, having - share)
    variance = together / (together - 1) * float(off @ off) / of**2
    alone = share * (1.0 - share)
    return proportion(count, of, min(float(of), max(float(together), alone / variance)))


@dataclass(frozen=True, slots=True)
class Distribution:
    """Of an error over flights, m; quantiles are those of one flight, infinite for a lost one."""

    flights: int
    mean: float
    """Of the flights that tracked to the end; NaN if none did."""
    median: float
    p90: float
    p99: float
    worst: float
    worst_tracked: float
    """Of the flights that tracked to the end; NaN if none did."""


def distribution(errors_m: Array) -> Distribution:
    """How an error is distributed.

    Args:
        errors_m: (flights,) infinite for a lost one.
    """
    if not len(errors_m):
        return Distribution(0, *[math.nan] * 6)
    tracked = errors_m[np.isfinite(errors_m)]
    # An average of a finite and an infinite error would say nothing: each is one of the flights.
    median, p90, p99 = np.quantile(errors_m, QUANTILES, method="inverted_cdf").tolist()
    return Distribution(
        flights=len(errors_m),
        mean=float(tracked.mean()) if len(tracked) else math.nan,
        median=median,
        p90=p90,
        p99=p99,
        worst=float(errors_m.max()),
        worst_tracked=float(tracked.max()) if len(tracked) else math.nan,
    )
