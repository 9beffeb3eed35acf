"""The MPC's problem of one axis with the states eliminated, and its closed-form optimum.

Variables are the references ``R = (r(k̄) … r(k̄+N_h))``; the outputs are ``Y = F x(k̄) + G R`` over
``k̄+1 … k̄+N_h+1``.  All positions are given relative to the desired position at k̄, so that nothing
depends on where the origin is.
"""

from dataclasses import dataclass

import numpy as np

from companion.control.reference_model import Array


@dataclass(frozen=True, slots=True)
class Weights:
    """The paper's weights, the same on each axis."""

    q: float
    """On the tracking error y* - y."""
    r: float
    """On r - y* (default) or on r itself (the paper's literal cost)."""
    s: float
    """On the difference r(k) - r(k-1)."""


@dataclass(frozen=True, slots=True)
class AxisProblem:
    """Constant matrices of one axis; n = N_h + 1."""

    position_from_state: Array
    """F (n, 2)."""
    position_from_r: Array
    """G (n, n)."""
    velocity_from_state: Array
    """(n, 2)."""
    velocity_from_r: Array
    """(n, n)."""
    difference: Array
    """(n, n): R ↦ first differences; the first row needs - r_prev beside it."""
    second_difference: Array
    """(n, n): R ↦ second differences; the first two rows need r_prev, r_prev2 beside them."""
    hessian: Array
    """(n, n), positive definite."""
    gradient: Array
    """(n, 2 + 1 + n + n): of (x, r_prev, y* at the outputs, target of r)."""
    gain: Array
    """The closed form: R = gain @ (x, r_prev, y* at the outputs, target of r)."""


def condense(a: Array, b: Array, horizon: int, weights: Weights) -> AxisProblem:
    """Build the constant matrices of one axis.

    Args:
        a: (2, 2) discrete model of (position, velocity).
        b: (2,) its input.
        horizon: N_h; there are N_h + 1 inputs and outputs.
        weights: of the cost.

    Raises:
        ValueError: the Hessian is not positive definite (all of q, r, s zero).
    """
    n = horizon + 1
    free = np.empty((n, 2, 2))
    power = np.eye(2)
    impulse = np.empty((n, 2))
    for k in range(n):
        impulse[k] = power @ b
        power = a @ power
        free[k] = power
    from_r = np.zeros((2, n, n))
    for k in range(n):
        for j in range(k + 1):
            from_r[:, k, j] = impulse[k - j]
    position_from_r, velocity_from_r = from_r
    difference = np.eye(n) - np.eye(n, k=-1)
    second = difference - np.vstack([np.zeros((1, n)), difference[:-1]])
    identity = np.eye(n)
    hessian = (
        weights.q * position_from_r.T @ position_from_r
        + weights.r * identity
        + weights.s * difference.T @ difference
    )
    gradient = np.hstack(
        [
            weights.q * position_from_r.T @ free[:, 0, :],
            -weights.s * difference.T[:, :1],
            -weights.q * position_from_r.T,
            -weights.r * identity,
        ]
    )
    try:
        np.linalg.cholesky(hessian)
    except np.linalg.LinAlgError as error:
        raise ValueError("the MPC's cost is not positive definite: give r or s > 0") from error
    gain: Array = np.asarray(-np.linalg.solve(hessian, gradient), dtype=np.float64)
    return AxisProblem(
        position_from_state=free[:, 0, :],
        position_from_r=position_from_r,
        velocity_from_state=free[:, 1, :],
        velocity_from_r=velocity_from_r,
        difference=difference,
        second_difference=second,
        hessian=hessian,
        gradient=gradient,
        gain=gain,
    )
