"""The solvers by the names that a configuration gives them."""

from typing import Literal

from companion.control.qp import daqp_solver
from companion.control.qp.daqp_solver import DaqpSolver
from companion.control.qp.osqp_solver import OsqpSolver
from companion.control.qp.port import QpSolverFactory

SolverName = Literal["osqp", "daqp"]


def solver_factory(name: SolverName) -> QpSolverFactory:
    """What sets up solvers of a name.

    Raises:
        ModuleNotFoundError: it is an extra that is not installed.
    """
    if name == "osqp":
        return OsqpSolver
    if not daqp_solver.installed():
        raise ModuleNotFoundError(daqp_solver.MISSING)
    return DaqpSolver
