"""The L1 adaptive output-feedback controller, extended by a proportional position loop.

Equations of the paper (Pereida & Schoellig 2018), per axis:

* outer loop          ``r1 = K (r2 - y2)``
* output predictor    ``ŷ1' = -m ŷ1 + m (u + σ̂)``
* adaptation law      ``σ̂' = Γ Proj(σ̂, -ỹ)``,  ``ỹ = ŷ1 - y1``
* control law         ``u = C(s) (r1 - σ̂)``,  ``C(s) = ω / (s + ω)``

Predictor and adaptation law are discretised together and exactly, for the interval between two
samples, with u held and the measured velocity y1 taken as linear in time.  An explicit Euler step
of the same equations is stable only for Γ dt ≤ 1, and chatters long before the position shows it.

The projection is the smooth operator of Hovakimyan & Cao (2010, appendix B): inside the bound it
does nothing, over the outermost part it scales the outward motion down to nothing.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from companion.control.reference_model import Array, oscillator_exponential


@dataclass(frozen=True, slots=True)
class L1Gains:
    """Gains per axis; tuples of equal length n (three for a vehicle)."""

    m: tuple[float, ...]
    """Bandwidth of the reference model M(s), 1/s."""
    omega: tuple[float, ...]
    """Bandwidth of the low-pass filter C(s), rad/s."""
    gain_k: tuple[float, ...]
    """Proportional gain K of the position loop, 1/s."""
    gamma: tuple[float, ...]
    """Adaptation rate Γ, 1/s²."""
    sigma_bound: tuple[float, ...]
    """Bound of |σ̂|, in the unit of u."""
    projection_margin: float = 0.1
    """Share ε of the bound over which the projection acts, 0..1."""


@dataclass(frozen=True, slots=True)
class L1Memory:
    """What the law carries from sample to sample; each array is (n,)."""

    predicted_velocity_m_s: Array
    """ŷ1."""
    sigma_hat: Array
    """σ̂, in the unit of u."""
    filtered_u: Array
    """State of C(s), which is its output u."""
    applied_u: Array
    """The u that went to the vehicle after its limits; the predictor sees this one."""
    last_velocity_m_s: Array
    """y1 of the last sample."""


@dataclass(frozen=True, slots=True)
class L1Record:
    """Why u is what it is; each array is (n,)."""

    r1_m_s: Array
    y_tilde_m_s: Array
    sigma_hat: Array
    u: Array
    projecting: bool
    """The projection held σ̂ back on some axis."""


@dataclass(frozen=True, slots=True)
class _Step:
    """One exact step: coefficients (n,) of ŷ, σ̂, u, y1 before and y1 after."""

    y: tuple[Array, Array, Array, Array, Array]
    sigma: tuple[Array, Array, Array, Array, Array]
    filter_decay: Array


def _axis_coefficients(m: float, gamma: float, dt_s: float) -> tuple[list[float], list[float]]:
    """Exact step of one axis: x = (ŷ, σ̂), A = [[-m, m], [-Γ, 0]], inputs (m, 0) u + (0, Γ) y1.

    With ``A⁻¹ = [[0, -1/Γ], [1/m, -1/Γ]]`` the integrals of the exponential are closed forms:
    ``P1 = ∫ exp = A⁻¹ (Φ - I)`` for held inputs, ``P2 = A⁻¹ (P1 / dt - I)`` for a rising ramp.
    """
    a = np.array([[-m, m], [-gamma, 0.0]])
    a_inverse = np.array([[0.0, -1.0 / gamma], [1.0 / m, -1.0 / gamma]])
    c, s = oscillator_exponential(-m, m * gamma, dt_s)
    phi = c * np.eye(2) + s * a
    held = a_inverse @ (phi - np.eye(2))
    ramp = a_inverse @ (held / dt_s - np.eye(2))
    from_u = held[:, 0] * m
    from_y_after = ramp[:, 1] * gamma
    from_y_before = held[:, 1] * gamma - from_y_after
    columns = np.column_stack([phi[:, 0], phi[:, 1], from_u, from_y_before, from_y_after])
    return columns[0].tolist(), columns[1].tolist()


@lru_cache(maxsize=256)
def _step_matrices(gains: L1Gains, dt_s: float) -> _Step:
    rows = [
        _axis_coefficients(m, gamma, dt_s) for m, gamma in zip(gains.m, gains.gamma, strict=True)
    ]
    y = np.array([row[0] for row in rows]).T
    sigma = np.array([row[1] for row in rows]).T
    decay = np.exp(-np.array(gains.omega) * dt_s)
    return _Step(
        y=(y[0], y[1], y[2], y[3], y[4]),
        sigma=(sigma[0], sigma[1], sigma[2], sigma[3], sigma[4]),
        filter_decay=decay,
    )


def start(velocity_m_s: Array, u: Array) -> L1Memory:
    """Memory with which the law begins without a bump.

    The predictor starts at the measured velocity and at rest (σ̂ = y1 - u), and u continues from
    the one that the vehicle has.

    Args:
        velocity_m_s: (n,) measured velocity y1.
        u: (n,) control input that is in effect.
    """
    velocity = np.array(velocity_m_s, dtype=float)
    held = np.array(u, dtype=float)
    return L1Memory(velocity, velocity - held, held, held, velocity)


def step(
    gains: L1Gains,
    memory: L1Memory,
    r2_m: Array,
    position_m: Array,
    velocity_m_s: Array,
    dt_s: float,
) -> tuple[L1Memory, L1Record]:
    """Advance the law by one sample.

    Args:
        gains: the gains.
        memory: from `start` or from the sample before.
        r2_m: (n,) position reference of the outer controller.
        position_m: (n,) measured position y2.
        velocity_m_s: (n,) measured velocity y1, never a predicted one.
        dt_s: time since the sample before, s; exact for any value.

    Returns:
        The new memory and the record; ``record.u`` is the control input.
    """
    matrices = _step_matrices(gains, dt_s)
    cy, cs = matrices.y, matrices.sigma
    y_hat, sigma, applied_u = memory.predicted_velocity_m_s, memory.sigma_hat, memory.applied_u
    before = memory.last_velocity_m_s
    y_next = cy[0] * y_hat + cy[1] * sigma + cy[2] * applied_u + cy[3] * before
    y_next += cy[4] * velocity_m_s
    sigma_next = cs[0] * y_hat + cs[1] * sigma + cs[2] * applied_u + cs[3] * before
    sigma_next += cs[4] * velocity_m_s
    projecting = False
    if (np.abs(sigma_next) * math.sqrt(1.0 + gains.projection_margin) > gains.sigma_bound).any():
        y_next, sigma_next, projecting = _project(
            gains, memory, y_next, sigma_next, velocity_m_s, dt_s
        )

    r1 = np.asarray(gains.gain_k) * (r2_m - position_m)
    decay = matrices.filter_decay
    u = decay * memory.filtered_u + (1.0 - decay) * (r1 - sigma_next)
    advanced = L1Memory(y_next, sigma_next, u, u, velocity_m_s)
    return advanced, L1Record(r1, y_next - velocity_m_s, sigma_next, u, projecting)


def with_applied(memory: L1Memory, applied_u: Array) -> L1Memory:
    """Tell the law what the limits after it left of u.

    The predictor must see what the vehicle gets, or the missing part looks like a disturbance; and
    the state of C(s) is held at the limit, or u runs away from it and takes 1/ω to come back.
    """
    return replace(memory, applied_u=applied_u, filtered_u=applied_u)


def _project(
    gains: L1Gains,
    memory: L1Memory,
    y_free: Array,
    sigma_free: Array,
    velocity_m_s: Array,
    dt_s: float,
) -> tuple[Array, Array, bool]:
    """Repeat the step of the axes that are near the bound, with the projection.

    ``Proj(σ̂, e) = e (1 - f)`` where ``f = ((1 + ε) σ̂² - bound²) / (ε bound²)`` is positive and e
    points outwards.  f is taken at the beginning of the step; a step that would still pass the
    bound, from inside or from the other side, ends on it.
    """
    y_next, sigma_next = y_free.copy(), sigma_free.copy()
    projecting = False
    eps = gains.projection_margin
    for i, bound in enumerate(gains.sigma_bound):
        old, new = float(memory.sigma_hat[i]), float(sigma_free[i])
        y_old, u = float(memory.predicted_velocity_m_s[i]), float(memory.applied_u[i])
        f = ((1.0 + eps) * old * old - bound * bound) / (eps * bound * bound)
        if f > 0.0 and (new - old) * old > 0.0:
            projecting = True
            rate = gains.gamma[i] * max(1e-6, 1.0 - f)
            inputs = np.array(
                [y_old, old, u, memory.last_velocity_m_s[i], velocity_m_s[i]], dtype=float
            )
            y_row, sigma_row = _axis_coefficients(gains.m[i], rate, dt_s)
            y_next[i] = inputs @ y_row
            new = float(inputs @ sigma_row)
            sigma_next[i] = new
        if abs(new) > bound:
            projecting = True
            sigma_next[i] = math.copysign(bound, new)
            decay = math.exp(-gains.m[i] * dt_s)
            held = 0.5 * (old + float(sigma_next[i]))
            y_next[i] = decay * y_old + (1.0 - decay) * (u + held)
    return y_next, sigma_next, projecting
