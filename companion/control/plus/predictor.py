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
    drag_1_s: Array,
    sigma_bound: Array,
    known_m_s2: Array,
    position_m: Array,
    velocity_m_s: Array,
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
    a = _transition(drag_1_s, dt_s)
    x = (a @ memory.estimate[:, :, None])[:, :, 0]
    x[:, 0] += 0.5 * dt_s * dt_s * known_m_s2
    x[:, 1] += dt_s * known_m_s2
    p = a @ memory.covariance @ a.transpose(0, 2, 1) + _process(noise, dt_s)

    innovation = np.stack([x[:, 0] - position_m, x[:, 1] - velocity_m_s], axis=1)
    s00 = p[:, 0, 0] + np.square(noise.position_m)
    s11 = p[:, 1, 1] + np.square(noise.velocity_m_s)
    s01 = p[:, 0, 1]
    determinant = s00 * s11 - s01 * s01
    inverse = np.empty((3, 2, 2))
    inverse[:, 0, 0], inverse[:, 1, 1] = s11 / determinant, s00 / determinant
    inverse[:, 0, 1] = inverse[:, 1, 0] = -s01 / determinant
    gain = p[:, :, :2] @ inverse
    corrected = x - (gain @ innovation[:, :, None])[:, :, 0]
    covariance = p - gain @ p[:, :2, :]
    covariance = 0.5 * (covariance + covariance.transpose(0, 2, 1))
    bounded = np.clip(corrected[:, 2], -sigma_bound, sigma_bound)
    projecting = bool((bounded != corrected[:, 2]).any())
    corrected[:, 2] = bounded
    return (
        PredictorMemory(corrected, covariance),
        PredictorRecord(innovation[:, 1], np.sqrt(s11), projecting),
    )


def _transition(drag_1_s: Array, dt_s: float) -> Array:
    a = np.zeros((3, 3, 3))
    a[:, 0, 0] = a[:, 1, 1] = a[:, 2, 2] = 1.0
    a[:, 0, 1] = dt_s
    a[:, 0, 2] = 0.5 * dt_s * dt_s
    a[:, 1, 1] = 1.0 - drag_1_s * dt_s
    a[:, 1, 2] = dt_s
    return a


def _process(noise: PredictorNoise, dt_s: float) -> Array:
    """Covariance of what acts on (p, v, σ) over a time."""
    w = np.square(noise.acceleration_m_s2_sqrt_hz)
    s = np.square(noise.sigma_walk)
    q = np.zeros((3, 3, 3))
    q[:, 0, 0] = w * dt_s**3 / 3.0 + s * dt_s**5 / 20.0
    q[:, 0, 1] = q[:, 1, 0] = w * dt_s**2 / 2.0 + s * dt_s**4 / 8.0
    q[:, 1, 1] = w * dt_s + s * dt_s**3 / 3.0
    q[:, 0, 2] = q[:, 2, 0] = s * dt_s**3 / 6.0
    q[:, 1, 2] = q[:, 2, 1] = s * dt_s**2 / 2.0
    q[:, 2, 2] = s * dt_s
    return q
