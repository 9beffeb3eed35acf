"""Which adaptation rates Γ suit the rate of the loop, and what limits them at either end.

Two things are looked at: predictor and adaptation law by themselves, as they are discretised, and
the whole sampled loop.  Explicit Euler of ``ŷ' = -m ŷ + m σ̂, σ̂' = -Γ ŷ`` has the matrix
``[[1 - m h, m h], [-Γ h, 1]]`` of determinant ``1 - m h (1 - Γ h)``: stable only for Γ h < 1.  The
exact step has no such limit by itself; but its mode, of frequency √(mΓ) and damping √(m/Γ)/2, must
be slower than half the sampling frequency, or the samples do not hold it.

Long before it comes to that the mode amplifies the measurement's noise.  Safe is therefore less
than stable: the rule of thumb is to sample ten times as fast as the mode, both read as angular
frequencies, ``10 √(mΓ) ≤ 2π / h``.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from companion.control import l1_adaptive
from companion.control.inner import L1Controller
from companion.control.l1_adaptive import L1Gains
from companion.control.reference_model import Array
from companion.control.transfer_function import TransferFunction
from companion.theory.margins import first_unstable
from companion.theory.sampled_data import SampledLoop, period_map

UpperReason = Literal["whole loop", "euler", "nyquist"]
_STEP = 1.5
_LOWEST = 1e-2
_LARGEST_MULTIPLE = 1e4
_FINE_STEP = 1.1
_SAMPLES_PER_TURN = 10.0
"""Of the adaptation mode, at the upper end of what is called safe."""
_UNREACHED = 1e100
"""A projection's bound that plays no part, and whose square is a number."""
_SEARCHED = 58
"""Steps either way from an unstable Γ: a factor of 250."""


@dataclass(frozen=True, slots=True)
class GammaRange:
    """Adaptation rates with which the sampled loop is stable, (axes,)."""

    low: Array
    """0 where none is too low; not a number where no rate is stable."""
    high: Array
    reasons: tuple[UpperReason, ...]
    """What limits the upper end: the loop as a whole, explicit Euler, or the sampling."""
    safe: Array
    """Largest rate that is sampled ten times a turn of its mode, or `high` where that is lower."""


def with_gamma(gains: L1Gains, gamma: Array) -> L1Gains:
    """The gains with other adaptation rates, (axes,)."""
    return replace(gains, gamma=tuple(float(value) for value in gamma))


def unprojected(gains: L1Gains) -> L1Gains:
    """The gains with a projection that never acts: what is linear is looked at.

    A small ỹ makes an oscillation of σ̂ that is √(Γ/m) times as large.
    """
    return replace(gains, sigma_bound=(_UNREACHED,) * len(gains.gamma))


def adaptation_radii(gains: L1Gains, sample_s: float) -> Array:
    """(axes,) spectral radii of predictor and adaptation law by themselves, as implemented.

    Infinite where the step's matrix is beyond the range of numbers.
    """
    gains = unprojected(gains)
    axes = len(gains.gamma)
    still = np.zeros(axes)
    rest = l1_adaptive.start(gains, still, still)
    order = rest.predictor.shape[1]
    columns = []
    for k in range(order + 1):
        start = np.zeros((axes, order + 1))
        start[:, k] = 1e-4
        memory = replace(rest, predictor=start[:, :order], sigma_hat=start[:, order])
        with np.errstate(over="ignore", invalid="ignore"):
            after, _ = l1_adaptive.step(gains, memory, still, still, still, sample_s)
            columns.append(np.column_stack([after.predictor, after.sigma_hat]) / 1e-4)
    matrices = np.stack(columns, axis=2)
    finite = np.array([np.isfinite(matrix).all() for matrix in matrices])
    matrices[~finite] = 0.0
    return np.where(finite, np.abs(np.linalg.eigvals(matrices)).max(axis=1), np.inf)


def sampling_limit(model: TransferFunction, sample_s: float) -> float:
    """Γ at which the adaptation mode reaches half the sampling frequency.

    At high frequencies M(s) is b/s, so that the mode is at √(bΓ); b is m for m / (s + m).
    """
    b = model.numerator[0] / model.denominator[0]
    return (np.pi / sample_s) ** 2 / b


def well_sampled_limit(model: TransferFunction, sample_s: float) -> float:
    """Γ at which ten times the adaptation mode's √(bΓ) is the sampling frequency in rad/s."""
    return sampling_limit(model, sample_s) * (2.0 / _SAMPLES_PER_TURN) ** 2


def safe_gamma(loop: SampledLoop, gains: L1Gains) -> GammaRange:
    """The range of Γ in which the sampled loop is stable, and how much of it is safe.

    Stable is meant with the outer controller and without. The range around the chosen Γ, or around
    the largest that the samples hold where the chosen one is beyond it; where the loop is unstable
    with that one, the range around the stable one that is nearest to it.

    Args:
        loop: with the L1 controller of these gains inside.
        gains: the gains.
    """
    axes = len(gains.gamma)
    gains = unprojected(gains)
    limits = np.array([sampling_limit(m, loop.sample_s) for m in gains.reference_model])

    def radii(gamma: Array) -> Array:
        other = with_gamma(gains, gamma)
        own = adaptation_radii(other, loop.sample_s)
        law = L1Controller(other)
        whole = period_map(replace(loop, inner=law)).radii
        # A fallback holds r2: the loop must be stable without the outer one, too.
        held = period_map(replace(loop, inner=law, outer=None)).radii
        return np.maximum(own, np.maximum(whole, held))

    own_limit = 1.0 / loop.sample_s if gains.discretisation == "euler" else np.inf
    base, stable = _nearest_stable(radii, np.array(gains.gamma), own_limit, limits)
    count = int(np.log(float(base.max()) / _LOWEST) / np.log(_STEP))
    falling = _STEP ** -np.arange(0.0, count)
    rising = _STEP ** np.arange(0.0, np.log(_LARGEST_MULTIPLE) / np.log(_STEP))
    low = base * first_unstable(lambda k: radii(base * k), falling, axes, 0.0)
    high = base * first_unstable(lambda k: radii(base * k), rising, axes, np.inf)
    reasons: list[UpperReason] = []
    for i, limit in enumerate(limits):
        reason: UpperReason = "whole loop"
        if high[i] >= limit:
            high[i], reason = limit, "nyquist"
        elif high[i] >= 0.99 * own_limit:
            reason = "euler"
        reasons.append(reason)
    nothing = np.full(axes, np.nan)
    stable &= low < high
    well = np.array([well_sampled_limit(m, loop.sample_s) for m in gains.reference_model])
    return GammaRange(
        low=np.where(stable, low, nothing),
        high=np.where(stable, high, nothing),
        reasons=tuple(reasons),
        safe=np.where(stable, np.minimum(high, well), nothing),
    )


def _nearest_stable(
    radii: Callable[[Array], Array], chosen: Array, own_limit: float, limits: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Stable rates near the chosen ones, up to the limits, and whether there are any, (axes,) each.

    Where the law has a limit of its own, looking begins just below it: the range may be narrow.
    """
    steps = [_FINE_STEP ** (sign * k) for k in range(1, _SEARCHED + 1) for sign in (-1.0, 1.0)]
    limits = np.minimum(limits, 0.98 * own_limit)
    start = np.minimum(chosen, limits)
    candidates = [start, *(np.minimum(start * k, limits) for k in steps)]
    base, stable = start.copy(), np.zeros(len(chosen), dtype=np.bool_)
    for candidate in candidates:
        better = ~stable & (radii(np.where(stable, base, candidate)) < 1.0)
        base = np.where(better, candidate, base)
        stable = stable | better
        if stable.all():
            break
    return base, stable
