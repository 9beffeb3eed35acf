"""How what a model leaves unexplained hangs together in time: the ground that intervals stand on.

Two kinds.  A reported *velocity* scatters by white noise and by the wander of whatever estimates
it, a damped oscillation of its position that white acceleration drives: over short times a random
walk, over long ones bounded.  A reported *angle* scatters by white noise and by an
Ornstein-Uhlenbeck process: what the loop that holds it lets through.  Their sizes are found by
maximum likelihood (Rasmussen & Williams 2006, eq. 2.30, with a flat prior on the nuisances as in
2.45) from the residuals themselves.
"""

import math
from collections.abc import Callable
from dataclasses import astuple, dataclass

import numpy as np

from companion.identification.recording import Array

_DAMPING = 0.7
"""Of the oscillation; the likelihood hardly depends on it."""
_FLAT = 1e3
"""Prior variance of a nuisance over the scatter's own: as good as flat."""
_LEAST = 1e-7
"""Share of the variance that is added for the factorisation's sake."""
_INCREMENT_STEPS = (1, 2, 3, 5, 8)
_LEAST_RMS = 1e-6
"""Of residuals: those of a simulation without noise still need a scale."""
_NORMAL_95 = 1.96
_RISE_95 = 0.5 * _NORMAL_95**2
"""Of the cost, the negative logarithm of the likelihood, at the ends of an interval."""
_FLAT_STEP = 0.4


@dataclass(frozen=True, slots=True)
class VelocityScatter:
    """Of a reported velocity, m/s."""

    white: float
    """Standard deviation of the white part."""
    density: float
    """Two-sided, of the driving acceleration, m/s²/√Hz: the walk's variance grows by its square
    per second."""
    restoring_rad_s: float
    """Natural frequency of the oscillation: beyond its period the walk is bounded."""

    @property
    def variance(self) -> float:
        """Of a sample."""
        return self.density**2 / (4.0 * _DAMPING * self.restoring_rad_s) + self.white**2

    def covariance(self, times_s: Array) -> Array:
        """(n, n) covariance of samples at (n,) times."""
        mean = _DAMPING * self.restoring_rad_s
        ringing = self.restoring_rad_s * math.sqrt(1.0 - _DAMPING**2)
        variance = self.density**2 / (4.0 * mean)
        # e^(-m (t-s)) (cos w(t-s) - m/w sin w(t-s)) for t >= s is a sum of products of functions of
        # t and of s: one product of matrices in place of n² sines.
        since_s = times_s - times_s[0]
        cosine, sine = np.cos(ringing * since_s), np.sin(ringing * since_s)
        share = mean / ringing
        later = np.exp(-mean * since_s)[:, None] * np.stack(
            [cosine - share * sine, sine + share * cosine], axis=1
        )
        sooner = np.exp(mean * since_s)[:, None] * np.stack([cosine, sine], axis=1)
        lower = np.tril(variance * (later @ sooner.T), -1)
        covariance: Array = lower + lower.T
        covariance[np.diag_indices_from(covariance)] = variance + self.white**2
        return covariance

    @staticmethod
    def starts(rms: float) -> tuple[tuple[float, float, float], ...]:
        """Start, least and greatest of each of the fields above, for residuals of this size."""
        least = max(rms, _LEAST_RMS)
        return (
            (0.3 * least, 1e-3 * least, 3.0 * least),
            (least, 1e-3 * least, 30.0 * least),
            (1.0, 0.1, 6.0),
        )


@dataclass(frozen=True, slots=True)
class LoopScatter:
    """Of what a loop holds against its command's response, in its unit."""

    white: float
    """Standard deviation of the white part."""
    wander: float
    """Standard deviation of the other one."""
    correlation_s: float
    """Time over which that falls to 1/e."""

    @property
    def variance(self) -> float:
        """Of a sample."""
        return self.wander**2 + self.white**2

    def covariance(self, times_s: Array) -> Array:
        """(n, n) covariance of samples at (n,) times."""
        lags = np.abs(times_s[:, None] - times_s[None, :])
        walk: Array = self.wander**2 * np.exp(-lags / self.correlation_s)
        return walk + self.white**2 * np.eye(len(times_s))

    @staticmethod
    def starts(rms: float) -> tuple[tuple[float, float, float], ...]:
        """Start, least and greatest of each of the fields above, for residuals of this size."""
        least = max(rms, _LEAST_RMS)
        return (
            (0.7 * least, 1e-3 * least, 3.0 * least),
            (0.7 * least, 1e-3 * least, 10.0 * least),
            (0.2, 0.03, 2.0),
        )


Scatter = VelocityScatter | LoopScatter


@dataclass(frozen=True, slots=True)
class Residual:
    """A stretch of what a model leaves, with what it cannot tell."""

    times_s: Array
    """(n,)"""
    values: Array
    """(n,)"""
    nuisances: Array
    """(n, k) shapes whose sizes are free, such as a constant."""


@dataclass(frozen=True, slots=True)
class FittedScatter:
    """The likeliest scatter, with the half-widths of the 95 % intervals of its sizes."""

    scatter: Scatter
    half_widths: tuple[float, float, float]
    """In the order of the scatter's fields."""


def factor(scatter: Scatter, times_s: Array, nuisances: Array) -> Array:
    """(n, n) lower Cholesky factor of the covariance, with the nuisances flat."""
    from scipy.linalg import cholesky

    covariance = scatter.covariance(times_s)
    variance = scatter.variance
    covariance += (_FLAT * variance) * (nuisances @ nuisances.T)
    covariance[np.diag_indices_from(covariance)] += _LEAST * variance
    lower: Array = cholesky(covariance, lower=True, overwrite_a=True, check_finite=False)
    return lower


def whitened(lower: Array, columns: Array) -> Array:
    """Columns in units in which the scatter is white and of variance 1."""
    from scipy.linalg import solve_triangular

    result: Array = solve_triangular(lower, columns, lower=True, check_finite=False)
    return result


def likeliest(
    kind: type[VelocityScatter] | type[LoopScatter],
    data: list[Residual],
    begin: Scatter | None = None,
) -> FittedScatter:
    """Find the sizes that make the residuals likeliest.

    Args:
        kind: of scatter.
        data: stretches that are taken as independent of each other; thin them out before, the
            effort grows with the cube of their lengths.
        begin: where to begin; None: where the size of the residuals suggests.
    """
    from scipy.optimize import minimize

    rms = float(np.sqrt(np.mean(np.concatenate([_centred(part) for part in data]) ** 2)))
    table = kind.starts(rms)

    def cost(logarithms: Array) -> float:
        scatter = kind(*np.exp(logarithms).tolist())
        total = 0.0
        for part in data:
            lower = factor(scatter, part.times_s, part.nuisances)
            white = whitened(lower, part.values)
            total += 0.5 * float(white @ white) + float(np.log(np.diag(lower)).sum())
            # The nuisances' prior grows with the scatter: what that adds to the determinant goes.
            total -= 0.5 * part.nuisances.shape[1] * math.log(scatter.variance)
        return total

    bounds = [(math.log(low), math.log(high)) for _, low, high in table]
    sizes = astuple(begin or _first_guess(kind, data, rms))
    found = minimize(
        cost,
        np.clip(np.log(sizes), *np.transpose(bounds)),
        method="L-BFGS-B",
        bounds=bounds,
        options={"eps": 1e-4, "ftol": 1e-6, "maxiter": 60},
    )
    best = np.asarray(found.x)
    white, size, time = np.exp(best).tolist()
    spread = _logarithmic_spread(cost, best)
    if kind is VelocityScatter and spread[1] >= 1.0:
        spread[1] = max(spread[1], _spread_above(cost, best, 1, bounds[1][1]))
    widths = [
        _NORMAL_95 * share * value for share, value in zip(spread, (white, size, time), strict=True)
    ]
    return FittedScatter(kind(white, size, time), (widths[0], widths[1], widths[2]))


def _first_guess(
    kind: type[VelocityScatter] | type[LoopScatter], data: list[Residual], rms: float
) -> Scatter:
    """Where to begin: the likelihood has more than one top."""
    if kind is LoopScatter:
        return LoopScatter(*(first for first, *_ in kind.starts(rms)))
    # The variance of increments: twice the white one, and the walk's times the lag.
    lags, variances = [], []
    for steps in _INCREMENT_STEPS:
        moved = [_centred(part)[steps:] - _centred(part)[:-steps] for part in data]
        taken = [part.times_s[steps:] - part.times_s[:-steps] for part in data]
        if all(len(change) for change in moved):
            lags.append(float(np.mean(np.concatenate(taken))))
            variances.append(float(np.mean(np.concatenate(moved) ** 2)))
    lag, variance = np.array(lags), np.array(variances)
    slope, level = np.polyfit(lag, variance, 1, w=1.0 / variance)
    least = (0.03 * rms) ** 2
    return VelocityScatter(
        math.sqrt(max(0.5 * float(level), least)), math.sqrt(max(float(slope), least)), 1.0
    )


def _centred(part: Residual) -> Array:
    size, *_ = np.linalg.lstsq(part.nuisances, part.values, rcond=None)
    rest: Array = part.values - part.nuisances @ size
    return rest


def _logarithmic_spread(cost: Callable[[Array], float], best: Array) -> list[float]:
    """Standard deviation of each logarithm, by the curvature of the cost along it."""
    spread = []
    step = 0.05
    lowest = cost(best)
    for index in range(len(best)):
        shift = np.zeros(len(best))
        shift[index] = step
        curvature = (cost(best + shift) - 2.0 * lowest + cost(best - shift)) / step**2
        spread.append(1.0 / math.sqrt(max(curvature, 1.0)))
    return spread


def _spread_above(cost: Callable[[Array], float], best: Array, index: int, largest: float) -> float:
    """The same upwards, by how far a logarithm can rise before 95 % speak against it.

    For a size that the residuals may do without: there the cost is flat below, and no parabola.
    """
    lowest = cost(best)
    risen, before, shift = 0.0, 0.0, np.zeros(len(best))
    while risen < _RISE_95 and best[index] + shift[index] < largest:
        before = risen
        shift[index] += _FLAT_STEP
        risen = cost(best + shift) - lowest
    share = 1.0 if risen <= before else min(1.0, (_RISE_95 - before) / (risen - before))
    return float(shift[index] - (1.0 - share) * _FLAT_STEP) / _NORMAL_95
