"""Ours: `Mpc.plan`, as it flies.  Closed form, check, and a solver for the axes that violate.

It checks the bounds on velocity and position too, which this problem has, though far away, and
tells what it did.
"""

from collections.abc import Sequence
from dataclasses import replace

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.problem import PERIOD_S, Problem, TickInput, mpc_settings
from companion.control.mpc import Mpc, MpcMemory
from companion.control.qp.daqp_solver import DaqpSolver
from companion.control.qp.osqp_solver import OsqpSolver
from companion.control.qp.port import QpSolverFactory
from companion.control.reference_model import Array


def memories(mpc: Mpc, ticks: Sequence[TickInput]) -> list[MpcMemory]:
    """What the controller remembers at each tick: the references that were recorded."""
    return [
        replace(mpc.start(tick.previous_m), applied_r_before_m=mpc.start(tick.before_m).applied_r_m)
        for tick in ticks
    ]


def make(problem: Problem, ticks: Sequence[TickInput], make_solver: QpSolverFactory) -> Made:
    """Set the controller up."""
    mpc = Mpc(mpc_settings(problem.horizon, problem.second_limit_m / PERIOD_S**2), make_solver)
    known = memories(mpc, ticks)

    def step(k: int) -> Array:
        tick = ticks[k]
        plan, _ = mpc.plan(known[k], tick.position_m, tick.velocity_m_s, tick.preview_m)
        assert plan is not None
        first: Array = plan[0]
        return first

    return Made(step)


CONTENDERS = [
    Contender(
        "check, then DAQP (ours)",
        "ours",
        lambda problem, ticks: make(problem, ticks, DaqpSolver),
        "daqp",
        "as it flies",
    ),
    Contender(
        "check, then OSQP (ours)",
        "ours",
        lambda problem, ticks: make(problem, ticks, OsqpSolver),
        "osqp",
        "as it flies",
    ),
]
