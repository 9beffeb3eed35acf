"""The port that every solver of the constrained problem stands behind.

``minimise ½ xᵀ P x + qᵀ x  subject to  lower ≤ A x ≤ upper``, with P and A fixed at construction
and q, lower, upper given at each solve.
"""

from dataclasses import dataclass
from typing import Protocol

from companion.control.reference_model import Array


@dataclass(frozen=True, slots=True)
class QpSolution:
    """What a solver found.  ``x`` is None unless it is finite and the solver vouches for it."""

    x: Array | None
    status: str
    iterations: int


class QpSolver(Protocol):
    """A solver set up for one P and A."""

    def solve(self, q: Array, lower: Array, upper: Array) -> QpSolution:
        """Solve for the given vectors; never raises, whatever they hold."""
        ...


class QpSolverFactory(Protocol):
    """Sets a solver up."""

    def __call__(self, p: Array, a: Array) -> QpSolver:
        """Set up for P (n, n) positive definite and A (rows, n), dense."""
        ...
