"""Bounds of the estimation error and of the way to the reference system: γ0 and γ1.

**γ0.**  Predictor and plant, written over M(s), differ by ``x̃' = A x̃ + B σ̃``, ``ỹ = C x̃``, with
``σ̃ = σ̂ - σ``, and the adaptation law is ``σ̂' = Γ Proj(σ̂, -ỹ)``.  M(s) is strictly positive real,
so that a P > 0 exists with ``P B = Cᵀ`` and ``Aᵀ P + P A = -Q < 0`` (Khalil, Nonlinear Systems,
3rd ed., lemma 6.3).  With ``V = x̃ᵀ P x̃ + σ̃² / Γ`` and the projection's property
``σ̃ (Proj(σ̂, e) - e) ≤ 0`` (Hovakimyan & Cao 2010, appendix B),

``V' ≤ -x̃ᵀ Q x̃ + 2 |σ̃| |σ'| / Γ ≤ -x̃ᵀ P x̃ / λ + 4 Δ Δ_d / Γ``,

for ``|σ|, |σ̂| ≤ Δ``, ``|σ'| ≤ Δ_d`` and λ the largest eigenvalue of ``P Q⁻¹``.  V can't grow once
``x̃ᵀ P x̃`` exceeds ``4 λ Δ Δ_d / Γ``, and ``σ̃² ≤ 4 Δ²``, hence

``|ỹ|² ≤ C P⁻¹ Cᵀ x̃ᵀ P x̃ ≤ C P⁻¹ Cᵀ (4 Δ² + 4 λ Δ Δ_d) / Γ = γ0²``.

For ``M = m / (s + m)``: P = 1/m, λ = 1/(2m), and ``γ0 = √((4 m Δ² + 2 Δ Δ_d) / Γ)``.  This is a
bound of the continuous-time law, derived here; it is not claimed to be equation (4.31) of
Hovakimyan & Cao (2010), to which the paper refers.

**γ1.**  The paper's ``γ1 = ‖C H / M‖ / (1 - ‖G‖ L) γ0``.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from companion.control.reference_model import Array
from companion.control.transfer_function import TransferFunction


@dataclass(frozen=True, slots=True)
class LyapunovPair:
    """What γ0 needs of a P with ``P B = Cᵀ`` and ``Aᵀ P + P A < 0``."""

    output_gain: float
    """``C P⁻¹ Cᵀ``, 1/s."""
    slowness_s: float
    """λ: largest eigenvalue of ``P Q⁻¹``."""

    def gamma_0(self, gamma: float, delta: float, delta_d: float) -> float:
        """γ0 of an adaptation rate Γ, a bound Δ of |σ| and |σ̂|, and a bound Δ_d of |σ'|, m/s."""
        grown = 4.0 * delta * delta + 4.0 * self.slowness_s * delta * delta_d
        return math.sqrt(self.output_gain * grown / gamma)


def lyapunov_pair(
    model: TransferFunction, delta: float = 1.0, delta_d: float = 10.0
) -> LyapunovPair | None:
    """A P of M(s), chosen for a small γ0; None if none was found.

    For M of first order there is one P.  For a higher order n the linear condition leaves
    n (n - 1) / 2 numbers free, which are searched; what is found is checked, so that the bound
    holds whichever P it is.

    Args:
        model: M(s), strictly positive real.
        delta: Δ with which γ0 is to be small.
        delta_d: Δ_d with which γ0 is to be small.
    """
    a, b, c = model.state_space()
    n = model.order
    if n == 1:
        rate = float(-a[0, 0])
        return LyapunovPair(float(b[0] * c[0] * c[0] / c[0]), 1.0 / (2.0 * rate))
    entries = [(i, j) for i in range(n) for j in range(i, n)]
    # P b = cᵀ as linear equations in the entries of the upper triangle of P.
    equations = np.zeros((n, len(entries)))
    for k, (i, j) in enumerate(entries):
        equations[i, k] += b[j]
        if i != j:
            equations[j, k] += b[i]
    particular, *_ = np.linalg.lstsq(equations, c, rcond=None)
    free = np.linalg.svd(equations)[2][n:].T

    def matrix(x: Array) -> Array:
        values = particular + free @ x
        p = np.zeros((n, n))
        for k, (i, j) in enumerate(entries):
            p[i, j] = p[j, i] = values[k]
        return p

    def cost(x: Array) -> float:
        p = matrix(x)
        smallest = min(np.linalg.eigvalsh(p)[0], np.linalg.eigvalsh(-(a.T @ p + p @ a))[0])
        if smallest <= 0.0:
            return 1e6 - 1e3 * float(smallest)
        pair = _pair(p, a, c)
        return math.log(pair.gamma_0(1.0, delta, delta_d))

    starts = [np.zeros(free.shape[1]), np.ones(free.shape[1]), -np.ones(free.shape[1])]
    options = {"maxiter": 4000, "maxfev": 4000, "xatol": 1e-8, "fatol": 1e-10}
    results = [minimize(cost, s, method="Nelder-Mead", options=options) for s in starts]
    best = min(results, key=lambda result: float(result.fun))
    if best.fun >= 1e5:
        return None
    return _pair(matrix(best.x), a, c)


def _pair(p: Array, a: Array, c: Array) -> LyapunovPair:
    q = -(a.T @ p + p @ a)
    slowness = float(np.linalg.eigvals(np.linalg.solve(q, p)).real.max())
    return LyapunovPair(float(c @ np.linalg.solve(p, c)), slowness)


def gamma_0(model: TransferFunction, gamma: float, delta: float, delta_d: float) -> float | None:
    """γ0 of an axis, m/s; None where no Lyapunov function was found for M(s)."""
    pair = lyapunov_pair(model, delta, delta_d)
    return None if pair is None else pair.gamma_0(gamma, delta, delta_d)


def gamma_1(norm_ch_over_m: float, norm_g: float, lipschitz: float, gamma_0: float) -> float:
    """γ1, m/s: bound of |y1_ref - y1|; infinite where the L1-norm condition fails."""
    if norm_g * lipschitz >= 1.0:
        return math.inf
    return norm_ch_over_m / (1.0 - norm_g * lipschitz) * gamma_0
