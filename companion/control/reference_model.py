"""The reference models of the paper and their exact discretisation.

* ``M_i(s) = m_i / (s + m_i)``: reference input r1 → velocity y1 (the paper's `refsys`).
* ``D_i(s) = K_i m_i / (s² + m_i s + K_i m_i)``: position reference r2 → position y2, the
  extended architecture's ideal system with ``r1 = K (r2 - y2)`` (the paper's `sosystem`).

The paper writes ``y1(k+1) = A_D y1(k) + B_D (r1(k) - y1(k))`` for the model inside the MPC; with
the zero-order hold of M(s) that has a DC gain of one half, so the unambiguous second-order form
is used here.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PositionModel:
    """D_i(s) of each axis."""

    m: tuple[float, ...]
    """Bandwidths of M(s), 1/s."""
    gain_k: tuple[float, ...]
    """K of the proportional position loop, 1/s."""


def oscillator_exponential(trace: float, determinant: float, dt_s: float) -> tuple[float, float]:
    """Coefficients (c, s) with ``exp(A dt) = c I + s A`` for a real 2×2 matrix A.

    Cayley–Hamilton, in the underdamped, the critically damped and the overdamped case; the
    result is exact for every dt.

    Args:
        trace: trace of A, 1/s.
        determinant: determinant of A, 1/s².
        dt_s: time, s.
    """
    half = 0.5 * trace
    decay = math.exp(half * dt_s)
    discriminant = half * half - determinant
    root = math.sqrt(abs(discriminant))
    if root * dt_s < 1e-7:
        cosine, sine_over_root = 1.0, dt_s
    elif discriminant < 0.0:
        cosine, sine_over_root = math.cos(root * dt_s), math.sin(root * dt_s) / root
    else:
        cosine, sine_over_root = math.cosh(root * dt_s), math.sinh(root * dt_s) / root
    return decay * (cosine - half * sine_over_root), decay * sine_over_root


def discretise_position_model(m: Array, gain_k: Array, dt_s: float) -> tuple[Array, Array]:
    """Zero-order hold of D_i(s) with the state (y2, y1) of each axis.

    Args:
        m: (n,) bandwidths of the reference models, 1/s.
        gain_k: (n,) gains K of the outer proportional loop, 1/s.
        dt_s: sampling time, s.

    Returns:
        A (n, 2, 2) and B (n, 2): ``x(k+1) = A x(k) + B r2(k)``, x = (position m, velocity m/s).
    """
    n = m.shape[0]
    a_discrete = np.empty((n, 2, 2))
    b_discrete = np.empty((n, 2))
    for i in range(n):
        stiffness = float(m[i] * gain_k[i])
        a = np.array([[0.0, 1.0], [-stiffness, -float(m[i])]])
        c, s = oscillator_exponential(-float(m[i]), stiffness, dt_s)
        a_discrete[i] = c * np.eye(2) + s * a
        # The steady state of r2 = 1 is (1, 0), so that B = (I - A_d) (1, 0).
        b_discrete[i] = np.array([1.0, 0.0]) - a_discrete[i] @ np.array([1.0, 0.0])
    return a_discrete, b_discrete
