"""How the reported state scatters, beyond what its motion explains.

The white part of a signal is what its third differences show at the sampling rate: motion, walk and
wander hardly change in 10 ms, and white noise of variance σ² makes 20 σ² of them.  Position is
taken less the integral of the reported velocity, so that fast flight does not count.  The density
of the unexplained acceleration is that of the random walk in the velocity that the lift and push
fits leave over, where white noise and walk part by their growth over time.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.identification.estimates import Estimate, NoiseEstimates
from companion.identification.parts import require
from companion.identification.recording import Array, Recording
from companion.identification.scatter import FittedScatter, LoopScatter, VelocityScatter
from companion.identification.signals import roll_pitch_rad, since_begin_s

_OF_THIRD_DIFFERENCES = 20.0
"""1 + 9 + 9 + 1."""
_CORRELATION = 2.0 * (15.0**2 + 6.0**2 + 1.0) / 20.0**2
"""Sum of their squared autocorrelations to both sides, beyond 1."""
_NORMAL_95 = 1.96
_FLAT, _LEAST_SPREAD = 1.0, 1e-3
_WALK_IN_THIRD_DIFFERENCES = 6.0
"""1 + 4 + 1, of a walk's variance per sample."""
_LEAST_SHARE = 0.01
_KEPT_OF_VARIANCE = 0.9248
"""Of a normal variable without the hundredth that is furthest from 0."""
_LARGEST_STEP = 1.6
"""Of the usual period: across a longer one nothing is told."""
_Three = tuple[Estimate, Estimate, Estimate]


def fit_noise(
    recording: Recording,
    scatters: tuple[FittedScatter, FittedScatter, FittedScatter],
    tilts: tuple[FittedScatter, FittedScatter],
) -> NoiseEstimates:
    """The noise of the reported state.

    Args:
        recording: any.
        scatters: of the velocity along x, y and z, from the fits.
        tilts: of roll and pitch.

    Raises:
        UnidentifiedError: there is no hover.
    """
    times = since_begin_s(recording)
    velocity = recording.velocity_enu_m_s
    steps = np.diff(times)[:, None]
    way = np.cumsum(0.5 * steps * (velocity[1:] + velocity[:-1]), axis=0)
    beyond = recording.position_enu_m - np.concatenate([np.zeros((1, 3)), way])
    roll, pitch = roll_pitch_rad(recording)
    quiet = require(recording, "hover")
    return NoiseEstimates(
        position_m=_three([_white([beyond[:, k]], times, "m") for k in range(3)]),
        velocity_m_s=_three(
            [_white([velocity[:, k]], times, "m/s", *_walk(scatters[k])) for k in range(3)]
        ),
        acceleration_m_s2_sqrt_hz=_three(densities([_density(scatter) for scatter in scatters])),
        tilt_rad=_white([roll[quiet], pitch[quiet]], times[quiet], "rad", _wander(tilts)),
    )


def _white(
    signals: list[Array], times_s: Array, unit: str, walk: float = 0.0, walk_spread: float = 0.0
) -> Estimate:
    """Standard deviation of the white part that signals have in common.

    Args:
        signals: (n,) each.
        times_s: (n,)
        unit: of the signals.
        walk: variance per second of a random walk in them, whose share is taken off.
        walk_spread: standard deviation of that.
    """
    periods = np.diff(times_s)
    usual = periods < _LARGEST_STEP * float(np.median(periods))
    whole = usual[:-2] & usual[1:-1] & usual[2:]
    squares = np.concatenate([np.diff(signal, 3)[whole] ** 2 for signal in signals])
    # A robust mean: steps of the command show in a few differences only.
    whole_mean = _trimmed_mean(squares)
    per_walk = _WALK_IN_THIRD_DIFFERENCES * float(np.median(periods))
    variance = max(whole_mean - per_walk * walk, _LEAST_SHARE * whole_mean) / _OF_THIRD_DIFFERENCES
    sigma = math.sqrt(variance)
    relative = math.sqrt(2.0 * (1.0 + _CORRELATION) / max(1, len(squares)))
    spread = math.hypot(relative * whole_mean, per_walk * walk_spread) / _OF_THIRD_DIFFERENCES
    return Estimate(sigma, _NORMAL_95 * spread / max(2.0 * sigma, 1e-12), unit)


def _trimmed_mean(squares: Array) -> float:
    """Mean of squares of a normal variable without the largest hundredth, made good for it."""
    limit = float(np.quantile(squares, 0.99))
    kept = squares[squares <= limit]
    return float(np.mean(kept)) / _KEPT_OF_VARIANCE if len(kept) else 0.0


def _walk(fitted: FittedScatter) -> tuple[float, float]:
    """Variance of the walk per second, and its standard deviation."""
    assert isinstance(fitted.scatter, VelocityScatter)
    density = fitted.scatter.density
    return density**2, 2.0 * density * fitted.half_widths[1] / _NORMAL_95


def _wander(fitted: tuple[FittedScatter, FittedScatter]) -> float:
    walks = []
    for one in fitted:
        assert isinstance(one.scatter, LoopScatter)
        walks.append(2.0 * one.scatter.wander**2 / one.scatter.correlation_s)
    return sum(walks) / len(walks)


@dataclass(frozen=True, slots=True)
class Density:
    """Of an unexplained acceleration along an axis, as the likelihood has it."""

    value: float
    spread: float
    """Standard deviation of its logarithm; 1 and more: there may be none."""

    @property
    def low(self) -> float:
        """Lower end of the 95 % interval."""
        return self.value * math.exp(-_NORMAL_95 * self.spread) if self.spread < _FLAT else 0.0

    @property
    def high(self) -> float:
        """Upper end."""
        return self.value * math.exp(_NORMAL_95 * self.spread)

    def estimate(self) -> Estimate:
        """As the files have it."""
        half = 0.5 * (self.high - self.low)
        return Estimate(self.value, half, "m/s²/√Hz", (self.low, self.high))


def densities(found: list[Density]) -> list[Estimate]:
    """Along x, y and z; what x and y have in common is told of both.

    The same estimator reports both, so that they differ by chance as long as their intervals meet:
    then the mean of their logarithms counts, each weighted by how well it is known.
    """
    x, y, z = found
    if x.low <= y.high and y.low <= x.high:
        x = y = _common(x, y)
    return [x.estimate(), y.estimate(), z.estimate()]


def _common(x: Density, y: Density) -> Density:
    weights = (x.spread**-2, y.spread**-2)
    mean = (weights[0] * math.log(x.value) + weights[1] * math.log(y.value)) / sum(weights)
    spread = 1.0 / math.sqrt(sum(weights))
    if min(x.spread, y.spread) >= _FLAT:
        # Two bounds are no figure: the sharper one stays, a bound.
        return min(x, y, key=lambda one: one.high)
    return Density(math.exp(mean), spread)


def _density(fitted: FittedScatter) -> Density:
    assert isinstance(fitted.scatter, VelocityScatter)
    density = fitted.scatter.density
    # Scatters that were given, and not fitted, have no widths.
    spread = fitted.half_widths[1] / (_NORMAL_95 * density)
    return Density(density, max(spread, _LEAST_SPREAD))


def _three(values: list[Estimate]) -> _Three:
    x, y, z = values
    return (x, y, z)
