"""The tick of the flight: the MPC and the L1 controller below it, and the whole stack with both."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.ours import memories
from benchmarks.tick.problem import AXES, MODEL, PERIOD_S, Problem, TickInput, mpc_settings
from benchmarks.tick.record import HOVER_S, TICKS
from companion.config.resolve import load_flight
from companion.control.frameworks import Reference, Tick
from companion.control.inner import L1Controller
from companion.control.l1_adaptive import L1Memory, first_order_gains
from companion.control.mpc import Mpc
from companion.control.qp.daqp_solver import DaqpSolver
from companion.control.qp.osqp_solver import OsqpSolver
from companion.control.qp.port import QpSolverFactory
from companion.control.reference_model import Array
from companion.flight.assemble import make_paper_stack
from companion.trajectories.harmonic import TEST_TRAJECTORIES
from companion.vehicle_state import VehicleState

_LEVEL = (1.0, 0.0, 0.0, 0.0)


def _inner() -> L1Controller:
    gains = first_order_gains(
        m=MODEL.m,
        omega=(0.25, 0.25, 4.0),
        gain_k=MODEL.gain_k,
        gamma=(1000.0,) * 3,
        sigma_bound=(16.0, 16.0, 8.0),
    )
    return L1Controller(gains)


def _outer(problem: Problem, make_solver: QpSolverFactory) -> Mpc:
    return Mpc(mpc_settings(problem.horizon, problem.second_limit_m / PERIOD_S**2), make_solver)


def make_laws(problem: Problem, ticks: Sequence[TickInput], make_solver: QpSolverFactory) -> Made:
    """The two laws alone: `Mpc.step`, then the L1 controller's step with its reference."""
    outer, inner = _outer(problem, make_solver), _inner()
    known = memories(outer, ticks)
    memory = [_begun(inner, ticks[0])]
    last = [-1]

    def prepare(k: int) -> None:
        if ticks[k].number != last[0] + 1 or ticks[k].number % TICKS == 0:
            memory[0] = _begun(inner, ticks[k])
        last[0] = ticks[k].number

    def step(k: int) -> Array:
        tick = ticks[k]
        position, velocity = tick.position_m, tick.velocity_m_s
        _, r2, _ = outer.step(known[k], position, velocity, tick.preview_m)
        memory[0], _ = inner.step(memory[0], r2, position, velocity, PERIOD_S)
        return r2

    return Made(step, prepare)


def _begun(inner: L1Controller, tick: TickInput) -> L1Memory:
    """The inner law where a flight begins: a leap of the state would look like a disturbance."""
    return inner.start(tick.position_m, tick.velocity_m_s, np.zeros(AXES))[0]


def make_stack(problem: Problem, ticks: Sequence[TickInput], make_solver: QpSolverFactory) -> Made:
    """The whole `Stack.step` of the `bebop2`, with a plan at each tick.

    It adds the reference, yaw, tilt and thrust to the two laws.  What it remembers of the outer
    controller is put back to what was recorded before each tick.
    """
    config = load_flight(None, {"vehicle": "bebop2", "controller": "mpc-l1"}, {})
    outer = _outer(problem, make_solver)
    shipped = make_paper_stack(config.controller, config.vehicle, config.mission)
    stack = replace(shipped, outer=outer, inner=_inner())
    known = memories(outer, ticks)
    states = [
        VehicleState(
            time_s=PERIOD_S * tick.number,
            position_enu_m=_triple(tick.position_m),
            velocity_enu_m_s=_triple(tick.velocity_m_s),
            attitude_flu_to_enu=_LEVEL,
            rate_flu_rad_s=(0.0, 0.0, 0.0),
        )
        for tick in ticks
    ]
    references = [_reference(tick.number // TICKS) for tick in ticks]
    due = [Tick(state, loop_delay_s=0.0, desired_yaw_rad=0.0) for state in states]
    memory = [stack.start(states[0])]
    last = [-1]

    def prepare(k: int) -> None:
        if ticks[k].number != last[0] + 1 or ticks[k].number % TICKS == 0:
            memory[0] = stack.start(replace(states[k], time_s=states[k].time_s - PERIOD_S))
        last[0] = ticks[k].number
        memory[0] = replace(memory[0], outer=known[k])

    def step(k: int) -> Array:
        memory[0], _, record = stack.step(memory[0], due[k], references[k])
        r2: Array = np.asarray(record.r2_m)
        return r2

    return Made(step, prepare)


def _reference(flight: int) -> Reference:
    """The desired position over the stack's time of a recorded flight."""
    trajectory = TEST_TRAJECTORIES[sorted(TEST_TRAJECTORIES)[flight]]
    begin_s = PERIOD_S * TICKS * flight + HOVER_S
    return lambda times_s: trajectory.position(times_s - begin_s)


def _triple(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


CONTENDERS = [
    Contender(
        f"{what}, {solver}",
        "flight",
        lambda problem, ticks, make=make, port=port: make(problem, ticks, port),  # type: ignore[misc]
        solver.lower(),
        "as it flies",
    )
    for what, make in (("MPC step + L1 step", make_laws), ("whole Stack.step", make_stack))
    for solver, port in (("DAQP", DaqpSolver), ("OSQP", OsqpSolver))
]
