"""The output predictor of MPC-L1+ and its adaptation law.

Per axis, on the nominal plant with the acceleration that the vehicle *has* (from the measured
tilt; from the thrust that acts) as its known input:

    p̂' = v̂                    + L_p ỹ
    v̂' = a - k v̂ + σ̂          + L_v ỹ          ỹ = (p̂ - p, v̂ - v)
    σ̂' = Proj(σ̂, L_σ ỹ)

The gains L are those of the Kalman filter for the stated noise of position and velocity, for
unexplained acceleration as white noise and for σ as a random walk: fast where the state is good,
slow where it is not, and well damped by themselves.  Its covariance runs along, so that any
interval between two samples is right, and tells how large ỹ may be.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from companion.control.reference_model import Array


@dataclass(frozen=True, slots=True)
class PredictorNoise:
    """What the gains are made of; each is of the axes (x, y, z), one standard deviation."""

    position_m: tuple[float, float, float]
    velocity_m_s: tuple[float, float, float]
    acceleration_m_s2_sqrt_hz: tuple[float, float, float]
    """Density of the unexplained acceleration."""
    sigma_walk: tuple[float, float, float]
    """Of the random walk of σ, m/s² per √s: how quickly the disturbance may change."""


@dataclass(frozen=True, slots=True)
class PredictorMemory:
    """What the predictor carries from sample to sample."""

    estimate: Array
    """(3, 3) by axis: p̂ m, v̂ m/s, σ̂ m/s²."""
    covariance: Array
    """(3, 3, 3) by axis."""


@dataclass(frozen=True, slots=True)
class PredictorRecord:
    """What the predictor says about a sample; each (3,)."""

    y_tilde_m_s: Array
    """ṽ, before the correction."""
    y_tilde_deviation_m_s: Array
    """Standard deviation that ṽ should have."""
    projecting: bool


def start(
    noise: PredictorNoise,
    position_m: Array,
    velocity_m_s: Array,
    sigma: Array,
    sigma_deviation: Array,
) -> PredictorMemory:
    """Memory at engagement: where the vehicle is, with what is known of σ (3,) each."""
    estimate = np.stack([position_m, velocity_m_s, sigma], axis=1)
    covariance = np.zeros((3, 3, 3))
    for i in range(3):
        covariance[i] = np.diag(
            [noise.position_m[i] ** 2, noise.velocity_m_s[i] ** 2, float(sigma_deviation[i]) ** 2]
        )
    return PredictorMemory(estimate, covariance)


def step(
    noise: PredictorNoise,
    memory: PredictorMemory,
    drag_1_s: Sequence[float] | Array,
    sigma_bound: Sequence[float] | Array,
    known_m_s2: Sequence[float] | Array,
    position_m: Sequence[float] | Array,
    velocity_m_s: Sequence[float] | Array,
    dt_s: float,
) -> tuple[PredictorMemory, PredictorRecord]:
    """Advance by one sample.

    Args:
        noise: what the gains are made of.
        memory: of the sample before.
        drag_1_s: (3,) k of each axis.
        sigma_bound: (3,) bound of |σ̂|.
        known_m_s2: (3,) mean acceleration by tilt and thrust since the sample before.
        position_m: (3,) measured.
        velocity_m_s: (3,) measured.
        dt_s: since the sample before, s.
    """
    known, drag, bounds = _floats(known_m_s2), _floats(drag_1_s), _floats(sigma_bound)
    positions, velocities = _floats(position_m), _floats(velocity_m_s)
    estimate, covariance = [], []
    y_tilde, deviation, projecting = [], [], False
    for i, (x, cov) in enumerate(
        zip(memory.estimate.tolist(), memory.covariance.tolist(), strict=True)
    ):
        (p, v, sigma), (p00, p01, p02, p11, p12, p22) = _predict(
            noise, i, x, cov, drag[i], known[i], dt_s
        )
        e_p, e_v = p - positions[i], v - velocities[i]
        s00, s11 = p00 + noise.position_m[i] ** 2, p11 + noise.velocity_m_s[i] ** 2
        determinant = s00 * s11 - p01 * p01
        # Gains of p, v and σ, by what ỹ they are of.
        pp, pv = (p00 * s11 - p01 * p01) / determinant, (p01 * s00 - p00 * p01) / determinant
        vp, vv = (p01 * s11 - p11 * p01) / determinant, (p11 * s00 - p01 * p01) / determinant
        sp, sv = (p02 * s11 - p12 * p01) / determinant, (p12 * s00 - p02 * p01) / determinant
        sigma -= sp * e_p + sv * e_v
        held = max(-bounds[i], min(bounds[i], sigma)) if math.isfinite(sigma) else sigma
        projecting = projecting or held != sigma
        estimate.append((p - pp * e_p - pv * e_v, v - vp * e_p - vv * e_v, held))
        c01 = 0.5 * (p01 - pp * p01 - pv * p11 + p01 - vp * p00 - vv * p01)
        c02 = 0.5 * (p02 - pp * p02 - pv * p12 + p02 - sp * p00 - sv * p01)
        c12 = 0.5 * (p12 - vp * p02 - vv * p12 + p12 - sp * p01 - sv * p11)
        covariance.append(
            (
                (p00 - pp * p00 - pv * p01, c01, c02),
                (c01, p11 - vp * p01 - vv * p11, c12),
                (c02, c12, p22 - sp * p02 - sv * p12),
            )
        )
        y_tilde.append(e_v)
        deviation.append(math.sqrt(s11))
    return (
        PredictorMemory(np.array(estimate), np.array(covariance)),
        PredictorRecord(np.array(y_tilde), np.array(deviation), projecting),
    )


def _floats(values: Sequence[float] | Array) -> Sequence[float]:
    if isinstance(values, np.ndarray):
        plain: list[float] = values.tolist()
        return plain
    return values


def _predict(
    noise: PredictorNoise,
    axis: int,
    estimate: list[float],
    covariance: list[list[float]],
    drag_1_s: float,
    known_m_s2: float,
    dt: float,
) -> tuple[tuple[float, float, float], tuple[float, float, float, float, float, float]]:
    """(p, v, σ) after a time, and the upper triangle of its covariance: 00, 01, 02, 11, 12, 22.

    Plain floats: for matrices of three by three these are several times quicker.
    """
    p, v, sigma = estimate
    (p00, p01, p02), (_, p11, p12), (_, _, p22) = covariance
    f, g = 1.0 - drag_1_s * dt, 0.5 * dt * dt
    w, s = noise.acceleration_m_s2_sqrt_hz[axis] ** 2, noise.sigma_walk[axis] ** 2
    m01, m02 = p01 + dt * p11 + g * p12, p02 + dt * p12 + g * p22
    m12 = f * p12 + dt * p22
    return (
        (p + dt * v + g * (sigma + known_m_s2), f * v + dt * (sigma + known_m_s2), sigma),
        (
            p00 + dt * p01 + g * p02 + dt * m01 + g * m02 + w * dt**3 / 3.0 + s * dt**5 / 20.0,
            f * m01 + dt * m02 + w * dt**2 / 2.0 + s * dt**4 / 8.0,
            m02 + s * dt**3 / 6.0,
            f * (f * p11 + dt * p12) + dt * m12 + w * dt + s * dt**3 / 3.0,
            m12 + s * dt**2 / 2.0,
            p22 + s * dt,
        ),
    )
