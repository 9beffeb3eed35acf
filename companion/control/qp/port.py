"""The port that every solver of the constrained problem stands behind.

``minimise ½ xᵀ P x + qᵀ x  subject to  lower ≤ A x ≤ upper``, with P and A fixed at construction
and q, lower, upper given at each solve.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from companion.control.reference_model import Array


@dataclass(slots=True)
class QpSolution:
    """What a solver found.  ``x`` is None unless it is finite and the solver vouches for it."""

    x: Array | None
    status: str
    iterations: int


class QpSolver(Protocol):
    """A solver set up for one P and A."""

    def solve(self, q: Array, lower: Array, upper: Array) -> QpSolution:
        """Solve for the given vectors; never raises, whatever they hold.

        The caller may overwrite the vectors afterwards; x is an array of its own.
        """
        ...


class QpSolverFactory(Protocol):
    """Sets a solver up."""

    def __call__(self, p: Array, a: Array) -> QpSolver:
        """Set up for P (n, n) positive definite and A (rows, n), dense."""
        ...


def input_problem(q: Array, lower: Array, upper: Array) -> str:
    """Why no solver may be given these vectors; empty if one may.  A row may be without a bound."""
    if not np.isfinite(q).all() or np.isnan(lower).any() or np.isnan(upper).any():
        return "input not finite"
    if (lower > upper).any() or (lower == np.inf).any() or (upper == -np.inf).any():
        return "bounds cross"
    return ""
