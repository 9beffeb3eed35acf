"""The shipped MPC over its own model, for what is easier seen without a vehicle."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from companion.config.resolve import load_flight
from companion.control.frameworks import Stack
from companion.control.mpc import Mpc, MpcMemory, MpcRecord
from companion.control.reference_model import Array, discretise_position_model
from companion.flight.assemble import make_stack

Target = Callable[[Array], Array]
"""Desired positions (samples, 3), m, at times (samples,), s."""


def shipped_mpc(**changes: object) -> Mpc:
    """The MPC of `mpc-l1` for the `bebop2`, with settings of `MpcSettings` changed."""
    from companion.control.qp.solvers import solver_factory

    config = load_flight(None, {"controller": "mpc-l1", "vehicle": "bebop2"}, {})
    stack = make_stack(config.controller, config.vehicle, config.mission)
    assert isinstance(stack, Stack)
    assert isinstance(stack.outer, Mpc)
    settings = replace(stack.outer.settings, **changes)  # type: ignore[arg-type]
    return Mpc(settings, solver_factory("osqp"))


@dataclass(frozen=True, slots=True)
class Planned:
    """One plan, and what it was made of."""

    time_s: float
    memory: MpcMemory
    """Before it."""
    position_m: Array
    velocity_m_s: Array
    plan_m: Array
    """(N_h + 1, 3): r2 at k̄ … k̄+N_h."""
    predicted_m: Array
    """(N_h + 1, 3): the positions that it leads to, at k̄+1 … k̄+N_h+1."""
    record: MpcRecord


def run(mpc: Mpc, target: Target, begin_s: float, end_s: float) -> list[Planned]:
    """Let the MPC steer its own model D(s) from rest at the target's first point."""
    a, b = discretise_position_model(
        np.array(mpc.model.m), np.array(mpc.model.gain_k), mpc.period_s
    )
    state = np.stack([target(np.array([begin_s]))[0], np.zeros(3)], axis=1)
    memory: MpcMemory = mpc.start(state[:, 0])
    made: list[Planned] = []
    for k in range(round((end_s - begin_s) / mpc.period_s)):
        now = begin_s + k * mpc.period_s
        before = memory
        memory, r2, record = mpc.step(
            before, state[:, 0], state[:, 1], target(now + mpc.preview_times_s)
        )
        made.append(
            Planned(
                now,
                before,
                state[:, 0].copy(),
                state[:, 1].copy(),
                memory.plan_m.copy(),
                np.array(record.predicted_position_m),
                record,
            )
        )
        state = np.einsum("nij,nj->ni", a, state) + b * r2[:, None]
    return made
