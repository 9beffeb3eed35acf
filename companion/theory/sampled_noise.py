"""What the noise of the measured velocity makes of ỹ and u in the sampled loop.

The bounds of the theory know no noise.  In the linear sampled loop white noise n of the velocity's
samples gives a state with the covariance P of the discrete Lyapunov equation
``P = Φ P Φᵀ + Σ b bᵀ`` over one period (Åström & Wittenmark, Computer-Controlled Systems, 3rd ed.,
section 10.4), and from it standard deviations of ỹ and u, in the mean over the samples of a period.
ỹ has n itself in it: no adaptation rate brings it below about that.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from companion.control.reference_model import Array
from companion.theory.sampled_data import (
    Outputs,
    PeriodRun,
    SampledLoop,
    basis_vectors,
    without_unmoved,
)

_SMALL_M_S = 1e-4


@dataclass(frozen=True, slots=True)
class NoiseGains:
    """Standard deviations per standard deviation of the measured velocity, (axes,) each.

    Not a number where the loop is unstable.
    """

    y_tilde: Array
    u_s_m: Array
    """In the unit of u per m/s."""


def noise_gains(loop: SampledLoop) -> NoiseGains:
    """How much of the velocity's noise comes to ỹ and to u."""
    run = PeriodRun(loop)
    by_state = [(run.from_state(b), float(b.max())) for b in basis_vectors(run)]
    by_noise = [(run.from_noise(k, _SMALL_M_S), _SMALL_M_S) for k in range(run.samples)]
    phi, c = _columns(by_state)
    phi = without_unmoved(phi)
    b, d = _columns(by_noise)
    axes = len(loop.plants)
    gains = np.full((2, axes), np.nan)
    for i in range(axes):
        if np.abs(np.linalg.eigvals(phi[i])).max() >= 1.0:
            continue
        covariance = solve_discrete_lyapunov(phi[i], b[i] @ b[i].T)
        for k in range(2):
            through = c[k, i] @ covariance @ c[k, i].T
            variance = np.trace(through) + (d[k, i] ** 2).sum()
            gains[k, i] = np.sqrt(variance / run.samples)
    return NoiseGains(gains[0], gains[1])


def _columns(
    runs: list[tuple[tuple[Array, Outputs], float]],
) -> tuple[Array, Array]:
    """(axes, size, runs) of the states and (2, axes, samples, runs) of ỹ and u, per unit."""
    states = np.stack([state / size for (state, _), size in runs], axis=2)
    outputs = np.stack([np.stack([o.y_tilde_m_s.T, o.u.T]) / size for (_, o), size in runs], axis=3)
    return states, outputs
