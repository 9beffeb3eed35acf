"""Which adaptation rates Γ suit the rate of the loop, and what limits them at either end.

Two things are looked at: predictor and adaptation law by themselves, as they are discretised, and
the whole sampled loop.  Explicit Euler of ``ŷ' = -m ŷ + m σ̂, σ̂' = -Γ ŷ`` has the matrix
``[[1 - m h, m h], [-Γ h, 1]]`` of determinant ``1 - m h (1 - Γ h)``: stable only for Γ h < 1.  The
exact step has no such limit; but its mode, of frequency √(mΓ) and damping √(m/Γ)/2, must be slower
than half the sampling frequency, or the samples do not hold it.
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


def with_gamma(gains: L1Gains, gamma: Array) -> L1Gains:
    """The gains with other adaptation rates, (axes,)."""
    return replace(gains, gamma=tuple(float(value) for value in gamma))


def adaptation_radii(gains: L1Gains, sample_s: float) -> Array:
    """(axes,) spectral radii of predictor and adaptation law by themselves, as implemented."""
    axes = len(gains.gamma)
    still = np.zeros(axes)
    rest = l1_adaptive.start(gains, still, still)
    order = rest.predictor.shape[1]
    columns = []
    for k in range(order + 1):
        start = np.zeros((axes, order + 1))
        start[:, k] = 1e-4
        memory = replace(rest, predictor=start[:, :order], sigma_hat=start[:, order])
        after, _ = l1_adaptive.step(gains, memory, still, still, still, sample_s)
        columns.append(np.column_stack([after.predictor, after.sigma_hat]) / 1e-4)
    radii: Array = np.abs(np.linalg.eigvals(np.stack(columns, axis=2))).max(axis=1)
    return radii


def sampling_limit(model: TransferFunction, sample_s: float) -> float:
    """Γ at which the adaptation mode reaches half the sampling frequency.

    At high frequencies M(s) is b/s, so that the mode is at √(bΓ); b is m for m / (s + m).
    """
    b = model.numerator[0] / model.denominator[0]
    return (np.pi / sample_s) ** 2 / b


def safe_gamma(loop: SampledLoop, gains: L1Gains) -> GammaRange:
    """The range of Γ in which the sampled loop is stable, with and without the outer controller.

    The range around the chosen Γ; where the loop is unstable with that one, the range around the
    stable one that is nearest to it.

    Args:
        loop: with the L1 controller of these gains inside.
        gains: the gains.
    """
    axes = len(gains.gamma)

    def radii(gamma: Array) -> Array:
        other = with_gamma(gains, gamma)
        own = adaptation_radii(other, loop.sample_s)
        law = L1Controller(other)
        whole = period_map(replace(loop, inner=law)).radii
        # A fallback holds r2: the loop must be stable without the outer one, too.
        held = period_map(replace(loop, inner=law, outer=None)).radii
        return np.maximum(own, np.maximum(whole, held))

    own_limit = 1.0 / loop.sample_s if gains.discretisation == "euler" else np.inf
    base, stable = _nearest_stable(radii, np.array(gains.gamma), own_limit)
    count = int(np.log(float(base.max()) / _LOWEST) / np.log(_STEP))
    falling = _STEP ** -np.arange(0.0, count)
    rising = _STEP ** np.arange(0.0, np.log(_LARGEST_MULTIPLE) / np.log(_STEP))
    low = base * first_unstable(lambda k: radii(base * k), falling, axes, 0.0)
    high = base * first_unstable(lambda k: radii(base * k), rising, axes, np.inf)
    reasons: list[UpperReason] = []
    for i, model in enumerate(gains.reference_model):
        limit = sampling_limit(model, loop.sample_s)
        reason: UpperReason = "whole loop"
        if high[i] >= limit:
            high[i], reason = limit, "nyquist"
        elif high[i] >= 0.99 * own_limit:
            reason = "euler"
        reasons.append(reason)
    nothing = np.full(axes, np.nan)
    return GammaRange(
        np.where(stable, low, nothing), np.where(stable, high, nothing), tuple(reasons)
    )


def _nearest_stable(
    radii: Callable[[Array], Array], chosen: Array, own_limit: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Stable rates near the chosen ones, and whether there are any, (axes,) each.

    Just below the law's own limit is looked at first: the range below it may be narrow.
    """
    steps = [_FINE_STEP ** (sign * k) for k in range(1, _SEARCHED + 1) for sign in (-1.0, 1.0)]
    candidates = [chosen, np.minimum(chosen, 0.98 * own_limit), *(chosen * k for k in steps)]
    base, stable = chosen.copy(), np.zeros(len(chosen), dtype=np.bool_)
    for candidate in candidates:
        better = ~stable & (radii(np.where(stable, base, candidate)) < 1.0)
        base = np.where(better, candidate, base)
        stable = stable | better
        if stable.all():
            break
    return base, stable
