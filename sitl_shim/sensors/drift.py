"""The damped, randomly driven oscillator behind an estimator's slow position error."""

from math import cos, cosh, exp, sin, sinh, sqrt
from typing import NamedTuple


class DriftStep(NamedTuple):
    """One exact step of position error e and velocity error f on one axis.

    e' = ee e + ef f + k11 n1;  f' = fe e + ff f + k21 n1 + k22 n2, with n1 and n2 white of
    unit variance.
    """

    ee: float
    ef: float
    fe: float
    ff: float
    k11: float
    k21: float
    k22: float


def drift_step(
    position_sigma: float, velocity_sigma: float, damping: float, step_s: float
) -> DriftStep:
    """Exact discretisation of e'' + 2 d w e' + w^2 e = white noise, with w = sigma_f / sigma_e.

    Its stationary covariance is diag(sigma_e^2, sigma_f^2), so the noise of a step has the
    covariance P - F P F', here in Cholesky factors.
    """
    omega = velocity_sigma / position_sigma
    mean = damping * omega
    # e^(A h) = e^(-d w h) (C I + S (A + d w I)), with C and S by the sign of 1 - d^2
    inside = omega * omega * (1.0 - damping * damping)
    root = sqrt(abs(inside))
    if root * step_s < 1e-9:
        even, odd = 1.0, step_s
    elif inside > 0.0:
        even, odd = cos(root * step_s), sin(root * step_s) / root
    else:
        even, odd = cosh(root * step_s), sinh(root * step_s) / root
    decay = exp(-mean * step_s)
    ee, ef = decay * (even + mean * odd), decay * odd
    fe, ff = -decay * omega * omega * odd, decay * (even - mean * odd)
    pe, pf = position_sigma**2, velocity_sigma**2
    q11 = pe - (ee * ee * pe + ef * ef * pf)
    q12 = -(ee * fe * pe + ef * ff * pf)
    q22 = pf - (fe * fe * pe + ff * ff * pf)
    # q11 goes with the cube of the step and may drown in rounding when that is tiny.
    k11 = sqrt(max(q11, 0.0))
    k21 = q12 / k11 if k11 > 0.0 else 0.0
    return DriftStep(ee, ef, fe, ff, k11, k21, sqrt(max(q22 - k21 * k21, 0.0)))
