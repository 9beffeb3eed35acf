"""DAQP behind the port: a dual active-set solver, exact, and the quickest on problems of this size.

One instance per problem, updated and warm-started from the active set of the solve before.  It
says "optimal" with NaN in x and keeps a bound active that has become infinite, so what goes in
and what comes out is checked here.

An extra: ``companion[daqp]``.
"""

import importlib.util
from typing import Any

import numpy as np

from companion.control.qp.port import QpSolution, input_problem
from companion.control.reference_model import Array

_OPTIMAL = 1
_STATUS = {
    -1: "primal infeasible",
    -2: "cycling",
    -3: "unbounded",
    -4: "iteration limit",
    -5: "not convex",
    -6: "overdetermined start",
}
_INFINITE = 1e30
"""From here on DAQP takes a row for one without a bound."""
_EXCESS = 1e-5
"""By which a row may lie outside its bounds: OSQP's tolerance, too."""
MISSING = "DAQP, an extra of its own, is not installed"


def installed() -> bool:
    """True if the extra is there."""
    return importlib.util.find_spec("daqp") is not None


class DaqpSolver:
    """One problem with fixed P and A."""

    def __init__(self, p: Array, a: Array, *, iterations: int = 1000) -> None:
        """Set up.

        Args:
            p: (n, n) positive definite.
            a: (rows, n).
            iterations: limit of iterations, which bounds the time of a tick by a count.

        Raises:
            ModuleNotFoundError: the extra is not installed.
            numpy.linalg.LinAlgError: P is not positive definite.
        """
        np.linalg.cholesky(p)  # DAQP would take P = 0 for a linear programme
        self._p = np.array(p, dtype=np.float64, order="C")
        self._a = np.array(a, dtype=np.float64, order="C")
        self._iterations = iterations
        # Overwritten at each solve.
        self._ordered = np.ones(len(self._a), dtype=bool)
        self._all_ordered = self._ordered.tobytes()
        self._outside = np.empty((2, len(self._a)))
        self._below, self._above = self._outside
        self._begin()

    @np.errstate(over="ignore", invalid="ignore")
    def solve(self, q: Array, lower: Array, upper: Array) -> QpSolution:
        """Solve; status "solved" or the reason why x is None."""
        np.less_equal(lower, upper, self._ordered)
        if (
            self._ordered.tobytes() == self._all_ordered
            and q.dot(q) < _INFINITE
            and lower.item(lower.argmin()) > -_INFINITE
            and upper.item(upper.argmax()) < _INFINITE
        ):
            return self._solved(q, lower, upper)
        problem = input_problem(q, lower, upper)
        if problem:
            return QpSolution(None, problem, 0)
        # Rows without a bound: an active set from before must not hold one of them.
        self._model.update(sense=self._inactive)
        return self._solved(q, lower, upper)

    def _solved(self, q: Array, lower: Array, upper: Array) -> QpSolution:
        """Solve for vectors that have been looked at."""
        if self._model.update(None, q, None, upper, lower) < 0:  # H, f, A and the bounds
            self._begin()
            return QpSolution(None, "update refused", 0)
        x, _, flag, info = self._model.solve()
        iterations = info["iterations"]
        if flag == _OPTIMAL:
            if self._vouched(x, lower, upper):
                return QpSolution(x, "solved", iterations)
            status = "not finite, or out of bounds"
        else:
            status = _STATUS.get(flag, f"exit flag {flag}")
        self._begin()
        return QpSolution(None, status, iterations)

    def _vouched(self, x: Array, lower: Array, upper: Array) -> bool:
        """Whether x keeps the bounds, which one that is not finite does not: it makes a NaN."""
        rows = self._a.dot(x)
        np.subtract(lower, rows, self._below)
        np.subtract(rows, upper, self._above)
        worst: float = self._outside.item(self._outside.argmax())
        return worst <= _EXCESS

    def _begin(self) -> None:
        """A new instance: nothing of a failure stays."""
        try:
            import daqp
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(MISSING) from error
        rows, n = self._a.shape
        self._inactive = np.zeros(rows, dtype=np.int32)
        self._model: Any = daqp.Model()
        self._model.settings = {"iter_limit": self._iterations}
        flag, _ = self._model.setup(self._p, np.zeros(n), self._a, np.ones(rows), -np.ones(rows))
        if flag < 0:
            raise RuntimeError(f"DAQP takes no problem with this P: exit flag {flag}")
