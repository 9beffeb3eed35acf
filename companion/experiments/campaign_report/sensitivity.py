"""How much a parameter decides of a figure, from flights as they were flown, with intervals.

First-order share: the correlation ratio (Pearson 1905), for independent parameters Sobol's
first-order index Var(E[y | x]) / Var(y), from given data by bins of x.  By chance alone bins
explain something; what a permutation of x explains on average is taken off, which for independent
rows is Kelley's correction (1935).  Rank correlation: Spearman's.

Rows of one cluster (the same conditions flown with several controllers or seeds) are not
independent: they are permuted and drawn together.  Everything is by a seed.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.report.flight_data import Array

Codes = NDArray[np.intp]
"""(rows,) a whole number from 0 for each row."""

RESAMPLES = 400
_FEW = 20
"""Clusters below which no interval is told."""
_TAILS = (0.025, 0.975)
_CHUNK = 4_000_000
"""Numbers that a block of resamples holds at most."""


@dataclass(frozen=True, slots=True)
class Share:
    """Of the variance of a figure, explained by one parameter alone."""

    value: float
    """Without what chance explains; in 0 … 1, NaN if the figure is the same everywhere."""
    low: float
    high: float
    """Ends of the 95 % interval; NaN where there are too few flights for one."""
    p: float
    """How often a permuted parameter explains as much."""


@dataclass(frozen=True, slots=True)
class Correlation:
    """Spearman's, with its 95 % interval; NaN where it is not known."""

    value: float
    low: float
    high: float


def ranks(values: Array) -> Array:
    """Ranks from 1, equal ones sharing the mean; infinite values are the last."""
    _, codes = np.unique(values, return_inverse=True)
    found: Array = _mid_ranks(codes, np.ones((1, len(values))))[0]
    return found


def first_order(
    codes: Codes,
    y: Array,
    clusters: Codes,
    seed: np.random.SeedSequence,
    resamples: int = RESAMPLES,
) -> Share:
    """The share of the variance of `y` between the levels of a parameter.

    The interval is the basic bootstrap's, over clusters: resamples are compared to the plain ratio
    of the sample, which is what is true where they come from.

    Args:
        codes: the parameter's level of each row.
        y: (rows,) finite.
        clusters: which rows belong together.
        seed: of the permutations and the resamples.
        resamples: how many of each.
    """
    generator = np.random.default_rng(seed)
    y = y - y.mean() if len(y) else y
    tables = _ClusterTables.of(codes, y, clusters)
    plain = float(tables.ratios(np.ones((1, tables.clusters)))[0])
    if not math.isfinite(plain):
        return Share(math.nan, math.nan, math.nan, math.nan)
    permuted = _permuted_ratios(codes, y, clusters, generator, resamples)
    chance = float(permuted.mean())
    if chance >= 1.0 - 1e-12:  # a level for each row explains everything, and says nothing
        return Share(math.nan, math.nan, math.nan, math.nan)
    value = (plain - chance) / (1.0 - chance)
    p = (1.0 + float((permuted >= plain - 1e-12).sum())) / (1.0 + resamples)
    low = high = math.nan
    if tables.clusters >= _FEW:
        drawn = tables.ratios(_draws(tables.clusters, generator, resamples))
        off = (drawn[np.isfinite(drawn)] - chance) / (1.0 - chance) - plain
        high, low = (value - np.quantile(off, _TAILS)).tolist()
    return Share(_clip(value), _clip(low), _clip(high), p)


def spearman(
    x: Array, y: Array, clusters: Codes, seed: np.random.SeedSequence, resamples: int = RESAMPLES
) -> Correlation:
    """Rank correlation of a number with a figure, which may be infinite.

    Args:
        x: (rows,)
        y: (rows,)
        clusters: which rows belong together; they are drawn together for the interval.
        seed: of the resamples.
        resamples: how many.
    """
    if len(x) < 3:
        return Correlation(math.nan, math.nan, math.nan)
    generator = np.random.default_rng(seed)
    _, x_codes = np.unique(x, return_inverse=True)
    _, y_codes = np.unique(y, return_inverse=True)
    value = float(_rank_correlations(x_codes, y_codes, np.ones((1, len(x))))[0])
    count = int(clusters.max()) + 1
    if count < _FEW or not math.isfinite(value):
        return Correlation(value, math.nan, math.nan)
    weights = _draws(count, generator, resamples)
    step = max(1, _CHUNK // len(x))
    drawn = np.concatenate(
        [
            _rank_correlations(x_codes, y_codes, weights[k : k + step][:, clusters])
            for k in range(0, resamples, step)
        ]
    )
    low, high = np.quantile(drawn[np.isfinite(drawn)], _TAILS).tolist()
    return Correlation(value, low, high)


@dataclass(frozen=True, slots=True)
class _ClusterTables:
    """Sums over each cluster's rows: a resample of clusters is a product with them."""

    count: Array
    """(clusters, levels)"""
    total: Array
    squares: Array
    """(clusters,)"""

    @classmethod
    def of(cls, codes: Codes, y: Array, clusters: Codes) -> "_ClusterTables":
        rows = int(clusters.max()) + 1 if len(clusters) else 0
        levels = int(codes.max()) + 1 if len(codes) else 0
        cell = clusters * levels + codes
        size = rows * levels
        return cls(
            np.bincount(cell, minlength=size).reshape(rows, levels).astype(float),
            np.bincount(cell, y, minlength=size).reshape(rows, levels).astype(float),
            np.bincount(clusters, y**2, minlength=rows).astype(float),
        )

    @property
    def clusters(self) -> int:
        return len(self.squares)

    def ratios(self, weights: Array) -> Array:
        """Correlation ratios, (resamples,), for how often each cluster is drawn."""
        return _ratios(weights @ self.count, weights @ self.total, weights @ self.squares)


def _ratios(count: Array, total: Array, squares: Array) -> Array:
    """Between the levels over the whole, for (resamples, levels) sums; NaN if nothing varies."""
    rows, whole = count.sum(axis=1), total.sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean_square = whole**2 / rows
        between = np.where(count > 0, total**2 / count, 0.0).sum(axis=1) - mean_square
        overall = squares - mean_square
        known = overall > 1e-12 * np.maximum(squares, 1e-300)
        found: Array = np.where(known, between / overall, np.nan)
    return found


def _permuted_ratios(
    codes: Codes, y: Array, clusters: Codes, generator: np.random.Generator, resamples: int
) -> Array:
    """What a parameter explains that is dealt out anew, in the way in which it was dealt out."""
    levels = int(codes.max()) + 1
    counts = np.bincount(clusters)
    first = np.unique(clusters, return_index=True)[1]
    varies = np.bincount(clusters, codes != codes[first][clusters]) > 0
    base = np.argsort(clusters, kind="stable")
    found = np.empty(resamples)
    for k in range(resamples):
        if not varies.any():  # sampled: a value for each cluster
            dealt = codes[first][generator.permutation(len(first))][clusters]
        elif counts[varies].sum() >= 0.5 * len(codes):  # crossed: each value within a cluster
            dealt = np.empty_like(codes)
            dealt[base] = codes[np.lexsort((generator.random(len(codes)), clusters))]
        else:
            dealt = generator.permutation(codes)
        count = np.bincount(dealt, minlength=levels)[None].astype(float)
        total = np.bincount(dealt, y, minlength=levels)[None].astype(float)
        found[k] = _ratios(count, total, np.array([float(y @ y)]))[0]
    return found


def _draws(count: int, generator: np.random.Generator, resamples: int) -> Array:
    """How often each of `count` is drawn, (resamples, count)."""
    drawn: Array = generator.multinomial(count, np.full(count, 1.0 / count), resamples).astype(
        float
    )
    return drawn


def _mid_ranks(codes: Codes, weights: Array) -> Array:
    """Ranks of values by their codes, each value there `weights` times, (resamples, rows)."""
    order = np.argsort(codes, kind="stable")
    starts = np.flatnonzero(np.diff(codes[order], prepend=-1))
    of_value = np.add.reduceat(weights[:, order], starts, axis=1)
    middle = of_value.cumsum(axis=1) - 0.5 * of_value + 0.5
    found: Array = middle[:, codes]
    return found


def _rank_correlations(x_codes: Codes, y_codes: Codes, weights: Array) -> Array:
    """Spearman's for each resample, (resamples,); NaN where one of the two is the same all over."""
    x, y = _mid_ranks(x_codes, weights), _mid_ranks(y_codes, weights)
    total = weights.sum(axis=1, keepdims=True)
    x -= (weights * x).sum(axis=1, keepdims=True) / total
    y -= (weights * y).sum(axis=1, keepdims=True) / total
    spread = np.sqrt((weights * x**2).sum(axis=1) * (weights * y**2).sum(axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        found: Array = np.where(spread > 0.0, (weights * x * y).sum(axis=1) / spread, np.nan)
    return found


def _clip(value: float) -> float:
    return value if math.isnan(value) else min(1.0, max(0.0, value))
