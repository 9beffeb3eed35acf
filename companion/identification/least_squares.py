"""Fits of a few parameters to correlated samples, with the covariance of what comes out.

Two weightings, for two situations.

*As they are* (`plain`): every sample counts the same, so what is fitted is the same model with or
without noise, and the scatter only makes the interval: ``(JᵀJ)⁻¹ Jᵀ R J (JᵀJ)⁻¹`` with the
scatter's covariance R in the middle, the sandwich of White (1980) with a model of R in place of
an estimate from the very residuals that a slightly wrong model leaves.

*Whitened* (`weighted`): generalised least squares, ``(Jᵀ R⁻¹ J)⁻¹``, for signals that drown in a
random walk if they are taken as they are.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from companion.identification.recording import Array

_ROUNDS = 40
_ENOUGH = 1e-4
"""A step smaller than this share of the parameters' scales ends the search."""


@dataclass(frozen=True, slots=True)
class Parameters:
    """What is fitted: where it begins, how far its derivative looks, and where it must stay."""

    start: Array
    steps: Array
    """Half the base of the central differences; also the scale of convergence."""
    low: Array
    high: Array


@dataclass(frozen=True, slots=True)
class Solution:
    """The values that fit best."""

    values: Array
    jacobian: Array
    """(samples, parameters) of the misfit, there."""
    misfit: Array
    """(samples,) there."""


def solve(misfit: Callable[[Array], Array], parameters: Parameters) -> Solution:
    """Least squares by Levenberg and Marquardt, with central differences and bounds.

    Args:
        misfit: model minus measurement, or the reverse, for (k,) values.
        parameters: see there.
    """
    values: Array = parameters.start.copy()
    rest: Array = misfit(values)
    damping = 1e-3
    jacobian = _jacobian(misfit, values, parameters)
    for _ in range(_ROUNDS):
        normal = jacobian.T @ jacobian
        slope = jacobian.T @ rest
        wide = np.diag(normal).max() * 1e-12
        change = -np.linalg.solve(normal + np.diag(damping * np.diag(normal) + wide), slope)
        tried = np.clip(values + change, parameters.low, parameters.high)
        left = misfit(tried)
        if float(left @ left) > float(rest @ rest):
            damping *= 8.0
            if damping > 1e8:
                break
            continue
        moved = np.abs(tried - values) / parameters.steps
        values, rest, damping = tried, left, damping / 6.0
        jacobian = _jacobian(misfit, values, parameters)
        if float(moved.max()) < _ENOUGH:
            break
    return Solution(values, jacobian, rest)


def sandwich(jacobian: Array, scatter: Array) -> Array:
    """(k, k) covariance of plain least squares under the (n, n) covariance of the samples."""
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    covariance: Array = bread @ (jacobian.T @ scatter @ jacobian) @ bread
    return covariance


def inverse_information(jacobian: Array) -> Array:
    """(k, k) covariance of least squares over whitened samples."""
    covariance: Array = np.asarray(np.linalg.pinv(jacobian.T @ jacobian), dtype=float)
    return covariance


def _jacobian(misfit: Callable[[Array], Array], values: Array, parameters: Parameters) -> Array:
    columns = []
    for index, step in enumerate(parameters.steps):
        up, down = values.copy(), values.copy()
        up[index] = min(values[index] + step, parameters.high[index])
        down[index] = max(values[index] - step, parameters.low[index])
        columns.append((misfit(up) - misfit(down)) / (up[index] - down[index]))
    return np.stack(columns, axis=1)
