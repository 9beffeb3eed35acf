"""Makes the recorded inputs: closed loops over the five trajectories, by the MPC that flies.

    python -m benchmarks.tick.record

Each trajectory is flown for 24 s: hover, then the path.  The vehicle is D(s) itself, pushed by a
disturbance that comes and goes, and measured with noise.  The two sets differ in the bound of the
second difference of r, which was chosen by the share of ticks that it constrains.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.tick.inputs import HORIZONS, Recording, write_recording
from benchmarks.tick.problem import MODEL, PERIOD_S, mpc_settings
from companion.control.mpc import Mpc
from companion.control.qp.daqp_solver import DaqpSolver
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


MIDDLE = range(200, 296)
"""Ticks of each flight that are kept of a flight at another horizon."""


@dataclass(frozen=True, slots=True)
class Conditions:
    """Of the flights of a set."""

    velocity_noise_m_s: float
    position_noise_m: float
    disturbance_m_s2: float
    """Deviation of a push that is forgotten over 1.5 s."""
    seed: int
    r_max_m_s2: Mapping[int, float]
    """By N_h: so that the share of constrained ticks is about the same at each."""


CONDITIONS = {
    "std": Conditions(
        0.015, 0.001, 0.3, 7, {10: 340.0, 20: 138.0, 30: 118.0, 40: 126.0, 60: 126.0, 80: 126.0}
    ),
    "hard": Conditions(
        0.015, 0.001, 0.3, 8, {10: 81.0, 20: 42.0, 30: 35.0, 40: 33.0, 60: 37.0, 80: 33.0}
    ),
}


def record(
    conditions: Conditions,
    make_solver: QpSolverFactory,
    horizon: int = HORIZON,
    ticks: int = TICKS,
) -> Recording:
    """Fly the trajectories and keep what the controller was given.

    Args:
        conditions: of the set.
        make_solver: of the constrained problems.
        horizon: N_h.
        ticks: of each trajectory.
    """
    rng = np.random.default_rng(conditions.seed)
    r_max = conditions.r_max_m_s2[horizon]
    mpc = Mpc(mpc_settings(horizon, r_max), make_solver)
    a, b = discretise_position_model(np.array(MODEL.m), np.array(MODEL.gain_k), PERIOD_S)
    times_s = PERIOD_S * np.arange(TICKS + PREVIEW) - HOVER_S
    rows: list[tuple[Array, ...]] = []
    paths, number, index = [], [], []
    kept = np.exp(-PERIOD_S / _DISTURBANCE_MEMORY_S)
    for name in sorted(TEST_TRAJECTORIES):
        path = TEST_TRAJECTORIES[name].position(times_s)
        state = np.stack([path[0], np.zeros(3)], axis=1)
        push = np.zeros(3)
        memory = mpc.start(path[0])
        for k in range(ticks):
            position = state[:, 0] + conditions.position_noise_m * rng.standard_normal(3)
            velocity = state[:, 1] + conditions.velocity_noise_m_s * rng.standard_normal(3)
            applied = np.array(memory.applied_r_m), np.array(memory.applied_r_before_m)
            rows.append((position, velocity, *applied))
            number.append(len(paths) * TICKS + k)
            index.append(len(paths) * len(path) + k)
            memory, r, _ = mpc.step(memory, position, velocity, path[k : k + horizon + 2])
            spread = conditions.disturbance_m_s2 * np.sqrt(1.0 - kept * kept)
            push = kept * push + spread * rng.standard_normal(3)
            state = np.einsum("aij,aj->ai", a, state) + b * np.array(r)[:, None]
            state[:, 1] += PERIOD_S * push
        paths.append(path)
    position, velocity, previous, before = (np.array(column) for column in zip(*rows, strict=True))
    return Recording(
        r_max,
        position,
        velocity,
        previous,
        before,
        np.array(number),
        np.array(index),
        np.concatenate(paths),
    )


def middle_of(recording: Recording) -> Recording:
    """The middle of each flight alone."""
    within = recording.number % TICKS
    kept = (within >= MIDDLE.start) & (within < MIDDLE.stop)
    flights = len(recording.path_m) // (TICKS + PREVIEW)
    length = len(MIDDLE) + PREVIEW
    path = recording.path_m.reshape(flights, TICKS + PREVIEW, -1)
    cut = path[:, MIDDLE.start : MIDDLE.start + length]
    number = recording.number[kept]
    return replace(
        recording,
        position_m=recording.position_m[kept],
        velocity_m_s=recording.velocity_m_s[kept],
        previous_m=recording.previous_m[kept],
        before_m=recording.before_m[kept],
        number=number,
        index=(number // TICKS) * length + number % TICKS - MIDDLE.start,
        path_m=cut.reshape(-1, cut.shape[2]),
    )


def main() -> None:
    """Record all."""
    for name, conditions in CONDITIONS.items():
        for horizon in HORIZONS:
            made = record(conditions, DaqpSolver, horizon)
            if horizon == HORIZON:
                write_recording(name, made)
            write_recording(f"{name}-{horizon}", middle_of(made))


if __name__ == "__main__":
    main()
