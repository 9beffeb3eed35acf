"""Makes the recorded inputs: closed loops over the five trajectories, by the MPC that flies.

    python -m benchmarks.tick.record

Each trajectory is flown for 24 s: hover, then the path.  The vehicle is D(s) itself, pushed by a
disturbance that comes and goes, and measured with noise.  The two sets differ in the bound of the
second difference of r and in the noise; both were chosen by the share of ticks that they constrain.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.tick.inputs import Recording, write_recording
from benchmarks.tick.problem import MODEL, PERIOD_S, mpc_settings
from companion.control.mpc import Mpc
from companion.control.qp.port import QpSolverFactory
from companion.control.reference_model import Array, discretise_position_model
from companion.trajectories.harmonic import TEST_TRAJECTORIES

TICKS = 480
"""Of each trajectory."""
PREVIEW = 82
"""N_h 80, and both ends."""
HORIZON = 30
HOVER_S = 4.0
_DISTURBANCE_MEMORY_S = 1.5


@dataclass(frozen=True, slots=True)
class Conditions:
    """Of the flights of a set."""

    r_max_m_s2: float
    velocity_noise_m_s: float
    position_noise_m: float
    disturbance_m_s2: float
    """Deviation of a push that is forgotten over 1.5 s."""
    seed: int


CONDITIONS = {
    "std": Conditions(118.0, 0.015, 0.001, 0.3, seed=7),
    "hard": Conditions(35.0, 0.015, 0.001, 0.3, seed=8),
}


def record(conditions: Conditions, make_solver: QpSolverFactory, ticks: int = TICKS) -> Recording:
    """Fly the trajectories and keep what the controller was given.

    Args:
        conditions: of the set.
        make_solver: of the constrained problems.
        ticks: of each trajectory.
    """
    rng = np.random.default_rng(conditions.seed)
    mpc = Mpc(mpc_settings(HORIZON, conditions.r_max_m_s2), make_solver)
    a, b = discretise_position_model(np.array(MODEL.m), np.array(MODEL.gain_k), PERIOD_S)
    times_s = PERIOD_S * np.arange(TICKS + PREVIEW) - HOVER_S
    rows: list[tuple[Array, ...]] = []
    paths, index = [], []
    kept = np.exp(-PERIOD_S / _DISTURBANCE_MEMORY_S)
    for number in sorted(TEST_TRAJECTORIES):
        path = TEST_TRAJECTORIES[number].position(times_s)
        state = np.stack([path[0], np.zeros(3)], axis=1)
        push = np.zeros(3)
        memory = mpc.start(path[0])
        for k in range(ticks):
            position = state[:, 0] + conditions.position_noise_m * rng.standard_normal(3)
            velocity = state[:, 1] + conditions.velocity_noise_m_s * rng.standard_normal(3)
            applied = np.array(memory.applied_r_m), np.array(memory.applied_r_before_m)
            rows.append((position, velocity, *applied))
            index.append(len(paths) * len(path) + k)
            memory, r, _ = mpc.step(memory, position, velocity, path[k : k + HORIZON + 2])
            spread = conditions.disturbance_m_s2 * np.sqrt(1.0 - kept * kept)
            push = kept * push + spread * rng.standard_normal(3)
            state = np.einsum("aij,aj->ai", a, state) + b * np.array(r)[:, None]
            state[:, 1] += PERIOD_S * push
        paths.append(path)
    position, velocity, previous, before = (np.array(column) for column in zip(*rows, strict=True))
    return Recording(
        conditions.r_max_m_s2,
        position,
        velocity,
        previous,
        before,
        np.array(index),
        np.concatenate(paths),
    )


def main() -> None:
    """Record both sets."""
    from companion.control.qp.daqp_solver import DaqpSolver

    for name, conditions in CONDITIONS.items():
        write_recording(name, record(conditions, DaqpSolver))


if __name__ == "__main__":
    main()
