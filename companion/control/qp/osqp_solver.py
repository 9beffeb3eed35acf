"""OSQP behind the port: one instance per problem, update-only, warm-started.

Tolerances are 1e-5: the default 1e-3 moves the first input by centimetres.  After any failure the
instance is reset, because a NaN once fed to it stays in its iterates for ever.
"""

from typing import Any

import numpy as np

from companion.control.qp.port import QpSolution, input_problem
from companion.control.reference_model import Array

_INITIAL_RHO = 0.1
_ACCEPTED = "solved"


class OsqpSolver:
    """One problem with fixed P and A."""

    def __init__(
        self, p: Array, a: Array, *, tolerance: float = 1e-5, iterations: int = 1000
    ) -> None:
        """Set up.

        Args:
            p: (n, n) positive definite.
            a: (rows, n).
            tolerance: absolute and relative tolerance.
            iterations: limit of iterations; it bounds the time of a tick, by a count and not by
                the clock, so that a flight can be repeated.
        """
        import osqp
        from scipy import sparse

        self._rows, self._n = a.shape
        self._osqp: Any = osqp.OSQP()
        self._osqp.setup(
            sparse.csc_matrix(np.triu(p)),
            np.zeros(self._n),
            sparse.csc_matrix(a),
            -np.ones(self._rows),
            np.ones(self._rows),
            verbose=False,
            eps_abs=tolerance,
            eps_rel=tolerance,
            max_iter=iterations,
            rho=_INITIAL_RHO,
            adaptive_rho=True,
            adaptive_rho_interval=25,
            polishing=False,
            warm_starting=True,
            check_termination=10,
        )

    def solve(self, q: Array, lower: Array, upper: Array) -> QpSolution:
        """Solve; status "solved" or the reason why x is None."""
        problem = input_problem(q, lower, upper)
        if problem:
            # OSQP would refuse crossing bounds, keep those before, and call that solved.
            return QpSolution(None, problem, 0)
        self._osqp.update(q=q, l=lower, u=upper)
        result = self._osqp.solve(raise_error=False)
        status = str(result.info.status)
        iterations = int(result.info.iter)
        if status != _ACCEPTED or not np.isfinite(result.x).all():
            self._reset()
            return QpSolution(None, status, iterations)
        return QpSolution(np.array(result.x), status, iterations)

    def _reset(self) -> None:
        self._osqp.warm_start(x=np.zeros(self._n), y=np.zeros(self._rows))
        self._osqp.update_settings(rho=_INITIAL_RHO)
