"""The optimum to 1e-10, by none of the solvers that are measured.

A primal-dual active-set iteration finds which bounds are active; what it ends on is taken only if
it fulfils the optimality conditions, which prove it, the problem being strictly convex.  Where the
iteration goes round in circles, the active set comes from non-negative least squares.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.tick.problem import AXES, Problem, TickInput, vectors_of
from companion.control.reference_model import Array

_AGREES = 1e-10
_TRIES = 50


@dataclass(frozen=True, slots=True)
class _Axis:
    hessian: Array
    inverse: Array
    rows: Array
    reach: Array
    """rows @ inverse @ rowsᵀ."""


class Reference:
    """The exact optimum of each axis."""

    def __init__(self, problem: Problem) -> None:
        """Invert the Hessians, which are small and well conditioned."""
        self._problem = problem
        self._axes = []
        for axis in problem.axes:
            inverse, rows = np.linalg.inv(axis.hessian), axis.second_difference
            self._axes.append(_Axis(axis.hessian, inverse, rows, rows @ inverse @ rows.T))

    def plan(self, tick: TickInput) -> Array:
        """The references (axes, n) about the desired position.

        Raises:
            ArithmeticError: no active set was found that fulfils the optimality conditions.
        """
        plan = np.empty((AXES, self._problem.horizon + 1))
        vectors = vectors_of(self._problem, tick)
        for i, axis in enumerate(self._axes):
            plan[i] = _optimum(axis, *(vector[i] for vector in vectors))
        return plan

    def first_input(self, tick: TickInput) -> Array:
        """References to apply (axes,), ENU m."""
        first: Array = self.plan(tick)[:, 0] + tick.preview_m[0]
        return first


def _optimum(axis: _Axis, gradient: Array, lower: Array, upper: Array) -> Array:
    """The optimum of one axis."""
    free = -axis.inverse @ gradient
    side = np.zeros(len(gradient), dtype=np.int64)
    for _ in range(_TRIES):
        x, multiplier = _with_active(axis, gradient, free, side, lower, upper)
        if _optimal(axis, gradient, x, multiplier, lower, upper):
            return x
        rows = axis.rows @ x
        side = np.where(multiplier + (rows - upper) > _AGREES, 1, 0)
        side = np.where(multiplier + (rows - lower) < -_AGREES, -1, side)
    side = _by_least_squares(axis, free, lower, upper)
    x, multiplier = _with_active(axis, gradient, free, side, lower, upper)
    if _optimal(axis, gradient, x, multiplier, lower, upper):
        return x
    raise ArithmeticError("no active set fulfils the optimality conditions")


def _with_active(
    axis: _Axis,
    gradient: Array,
    free: Array,
    side: NDArray[np.int64],
    lower: Array,
    upper: Array,
) -> tuple[Array, Array]:
    """Optimum and multipliers with some rows held at a bound (side 1: upper, -1: lower)."""
    active = np.flatnonzero(side)
    multiplier = np.zeros(len(free))
    x = free
    held = np.where(side > 0, upper, lower)[active]
    for _ in range(2):  # the second time takes away what rounding left
        missing = axis.rows[active] @ x - held
        if len(active):
            reach = axis.reach[np.ix_(active, active)]
            multiplier[active] += np.linalg.solve(reach, missing)
        x = -axis.inverse @ (gradient + axis.rows.T @ multiplier)
    return x, multiplier


def _optimal(
    axis: _Axis, gradient: Array, x: Array, multiplier: Array, lower: Array, upper: Array
) -> bool:
    """Stationary, within bounds, and each multiplier pushes inwards from the bound it is at."""
    rows = axis.rows @ x
    stationary = np.abs(axis.hessian @ x + gradient + axis.rows.T @ multiplier).max()
    outside = max(float((rows - upper).max()), float((lower - rows).max()))
    at_upper = np.where(multiplier > 0.0, np.abs(rows - upper), 0.0)
    at_lower = np.where(multiplier < 0.0, np.abs(rows - lower), 0.0)
    loose = max(float(at_upper.max()), float(at_lower.max()))
    return bool(max(float(stationary), outside, loose) <= _AGREES)


def _by_least_squares(axis: _Axis, free: Array, lower: Array, upper: Array) -> NDArray[np.int64]:
    """Active rows by Lawson and Hanson's least-distance programming."""
    from scipy.optimize import nnls

    root = np.linalg.cholesky(axis.hessian)
    inwards = np.linalg.solve(root, np.vstack([axis.rows, -axis.rows]).T).T
    at_free = axis.rows @ free
    room = np.concatenate([upper - at_free, at_free - lower])
    n = len(free)
    system = np.vstack([-inwards.T, -room[None, :]])
    weights, _ = nnls(system, np.append(np.zeros(n), 1.0))
    pushed = weights > 1e-12
    return np.asarray(pushed[:n].astype(np.int64) - pushed[n:].astype(np.int64))
