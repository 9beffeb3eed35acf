"""Stability of the loop as it is flown: the very laws, sampled, around a discretised plant.

Nothing is linearised by hand.  While no projection, limit or constraint acts, the implemented laws
are linear in memory and measurement, so that their matrix is what they make of basis vectors: each
state of one axis is set to a small value, the loop runs for one period, and what comes out is a
column (the axes do not see each other, so that one run gives a column of each).  The plant A(s)
with its position is discretised exactly under a held input, and its delay is held samples: a whole
number of them and a remainder (Åström & Wittenmark, Computer-Controlled Systems, 3rd ed., section
2.3).  The outer controller runs at its own slower rate, from the state carried over the delay, just
as `companion.control.frameworks` runs it; the period is then the first common multiple of the two
rates (a lifted, multirate system).  The loop is stable exactly if the matrix has a spectral radius
below 1.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from companion.control import delay
from companion.control.interfaces import InnerController, OuterController
from companion.control.mpc import MpcRecord
from companion.control.reference_model import Array
from companion.theory.plant import AxisPlant, ComplexArray
from companion.theory.sampled_plant import hold
from companion.theory.sampled_state import LoopState, pack, unpack

_SMALL = 1e-4
"""Of the basis vectors: far from every limit of the laws."""
_LONGEST_PERIOD = 80
"""Samples."""


@dataclass(frozen=True, slots=True)
class SampledLoop:
    """What is closed around the plant, and how fast."""

    plants: tuple[AxisPlant, ...]
    inner: InnerController
    outer: OuterController | None
    """None: the position reference r2 rests."""
    sample_s: float
    """Period of the state's samples."""
    known_delay_s: float
    """The loop's delay as the controller knows it, over which its state is carried."""
    gain: Array
    """(axes,) factor on the plant's input; 1 for the plant as it is."""
    more_delay_s: Array
    """(axes,) delay of the plant that nobody knows of; 0 for the plant as it is."""


def sampled_loop(
    plants: tuple[AxisPlant, ...],
    inner: InnerController,
    outer: OuterController | None,
    sample_s: float,
    known_delay_s: float,
) -> SampledLoop:
    """A loop around the plant as it is."""
    n = len(plants)
    return SampledLoop(plants, inner, outer, sample_s, known_delay_s, np.ones(n), np.zeros(n))


@dataclass(frozen=True, slots=True)
class PeriodMap:
    """How the states of each axis go over one period."""

    matrices: Array
    """(axes, states, states)."""
    period_s: float

    @property
    def radii(self) -> Array:
        """(axes,) spectral radii over one period."""
        radii: Array = np.abs(np.linalg.eigvals(self.matrices)).max(axis=1)
        return radii

    @property
    def critical(self) -> ComplexArray:
        """(axes,) the slowest pole of each axis in continuous time, 1/s.

        Its imaginary part is known up to whole turns per period.
        """
        values = np.linalg.eigvals(self.matrices).astype(np.complex128)
        largest = values[np.arange(len(values)), np.abs(values).argmax(axis=1)]
        return np.asarray(np.log(largest) / self.period_s, dtype=np.complex128)


@dataclass(frozen=True, slots=True)
class Outputs:
    """What the L1 controller does over a period; each array is (samples, axes)."""

    y_tilde_m_s: Array
    u: Array


class PeriodRun:
    """Runs a loop for one common period of all rates, from any state."""

    def __init__(self, loop: SampledLoop) -> None:
        """Discretise the plant and find the period.

        Raises:
            ValueError: the rates have no common multiple within a reasonable time.
        """
        self.loop = loop
        plans = _plan_ticks(loop)
        self.samples = plans[-1]
        self._plans = plans[:-1]
        self._held = [
            hold(plant, loop.sample_s, float(loop.gain[i]), float(loop.more_delay_s[i]))
            for i, plant in enumerate(loop.plants)
        ]
        # The laws' memories have their final shape after a first period, of which nothing comes.
        self._rest, _ = self._run(self._at_rest(), None)
        self.size = pack(self._rest).shape[1]

    def from_state(self, vector: Array) -> tuple[Array, Outputs]:
        """The state (axes, size) after a period, and what happened, from a state (axes, size)."""
        state, outputs = self._run(unpack(self._rest, vector), None)
        return pack(state), outputs

    def from_noise(self, sample: int, velocity_m_s: float) -> tuple[Array, Outputs]:
        """The same from rest, with one sample of the velocity measured wrong."""
        state, outputs = self._run(self._rest, (sample, velocity_m_s))
        return pack(state), outputs

    def _at_rest(self) -> LoopState:
        loop, axes = self.loop, len(self._held)
        still = np.zeros(axes)
        inner, _ = loop.inner.start(still, still, still)
        outer = loop.outer.start(still) if loop.outer is not None else None
        references = 0 if loop.outer is None else 1
        if loop.outer is not None and loop.outer.model is not None:
            period = max(loop.outer.period_s, loop.sample_s)
            references += math.ceil(loop.known_delay_s / period) + 1
        return LoopState(
            plant=np.zeros((axes, max(len(plant.late) for plant in self._held))),
            sent=np.zeros((axes, 1 + max(plant.whole for plant in self._held))),
            inner=inner,
            outer=outer,
            references=np.zeros((axes, references)),
        )

    def _run(self, state: LoopState, noise: tuple[int, float] | None) -> tuple[LoopState, Outputs]:
        loop, held, axes = self.loop, self._held, len(self._held)
        known, plans = state.references.shape[1], len(self._plans)
        # Plans before this period, the newest first, each with its tick.
        past = [
            (self._plans[-1 - k % plans] - self.samples * (1 + k // plans), state.references[:, k])
            for k in range(known)
        ]
        position_at = [len(plant.late) - 1 for plant in held]
        x, sent = np.zeros_like(state.plant), state.sent
        for i, plant in enumerate(held):  # an axis of fewer states has none behind them
            x[i, : len(plant.late)] = state.plant[i, : len(plant.late)]
        inner, outer = state.inner, state.outer
        y_tilde, u = [], []
        for tick in range(self.samples):
            velocity = x[:, 0].copy()
            if noise is not None and noise[0] == tick:
                velocity += noise[1]
            position = x[np.arange(axes), position_at]
            if tick in self._plans and loop.outer is not None:
                since_s = (tick - past[0][0]) * loop.sample_s
                outer, r2 = _plan(loop, outer, past, position, velocity, tick, since_s)
                past.insert(0, (tick, r2))
            r2 = past[0][1] if past else np.zeros(axes)
            inner, record = loop.inner.step(inner, r2, position, velocity, loop.sample_s)
            inner = loop.inner.with_applied(inner, record.u)
            y_tilde.append(record.y_tilde_m_s)
            u.append(record.u)
            with_new = np.column_stack([record.u, sent])
            for i, plant in enumerate(held):
                n = len(plant.late)
                x[i, :n] = (
                    plant.phi @ x[i, :n]
                    + plant.early * with_new[i, plant.whole]
                    + plant.late * with_new[i, plant.whole + 1]
                )
            sent = with_new[:, :-1]
        references = np.array([r2 for _, r2 in past[:known]]).reshape(known, axes).T
        outputs = Outputs(np.array(y_tilde), np.array(u))
        return LoopState(x, sent, inner, outer, references), outputs


def period_map(loop: SampledLoop) -> PeriodMap:
    """The matrix of one period for each axis.

    Raises:
        ValueError: the rates have no common multiple within a reasonable time, or a constraint
            of the outer controller acts on a small deviation.
    """
    run = PeriodRun(loop)
    columns = [run.from_state(basis)[0] / _SMALL for basis in basis_vectors(run)]
    matrices = without_unmoved(np.stack(columns, axis=2))
    return PeriodMap(matrices, run.samples * loop.sample_s)


def without_unmoved(matrices: Array) -> Array:
    """The matrices (axes, states, states) without what nothing moves, and so stays at 0.

    The integral of a PID without an integral gain is an example: it is no mode of the loop.
    """
    unmoved = (matrices == np.eye(matrices.shape[1])).all(axis=2)
    return np.where(unmoved[:, :, None], 0.0, matrices)


def basis_vectors(run: PeriodRun) -> list[Array]:
    """One small state (axes, size) for each of its entries."""
    axes = len(run.loop.plants)
    return [np.tile(_SMALL * row, (axes, 1)) for row in np.eye(run.size)]


def _plan_ticks(loop: SampledLoop) -> list[int]:
    """Ticks of a period at which the outer controller runs, and the period's length as the last."""
    period = loop.outer.period_s if loop.outer is not None else 0.0
    if period <= 0.0:
        return [0, 1]
    ticks = [0]
    for plan in range(1, _LONGEST_PERIOD + 1):
        tick = math.ceil((plan * period - 1e-6) / loop.sample_s)
        if tick > _LONGEST_PERIOD:
            break
        if tick > ticks[-1]:
            ticks.append(tick)
        if abs(tick * loop.sample_s - plan * period) < 1e-6:
            return ticks
    raise ValueError(
        f"samples every {loop.sample_s * 1e3:g} ms and plans every {period * 1e3:g} ms have no "
        f"common period within {_LONGEST_PERIOD} samples; choose a rate that divides the plans' "
        "period, as 100 Hz does 30 ms"
    )


def _plan(
    loop: SampledLoop,
    memory: Any,  # noqa: ANN401 - the outer controller's own
    past: list[tuple[int, Array]],
    position: Array,
    velocity: Array,
    tick: int,
    since_s: float,
) -> tuple[Any, Array]:
    """Run the outer controller with y* = 0, as `companion.control.frameworks` does."""
    outer = loop.outer
    assert outer is not None
    model = outer.model
    if model is not None:
        now_s, late_s = tick * loop.sample_s, loop.known_delay_s
        applied = tuple(
            delay.AppliedReference(at * loop.sample_s + late_s, r2) for at, r2 in reversed(past)
        )
        position, velocity = delay.carry(
            model.m, model.gain_k, position, velocity, now_s, now_s + late_s, applied
        )
    preview = np.zeros((len(outer.preview_times_s), len(position)))
    memory, r2, record = outer.step(memory, position, velocity, preview, since_s)
    if isinstance(record, MpcRecord) and record.status != "closed_form":
        raise ValueError("a constraint of the MPC acts at rest: the loop there is not linear")
    return memory, r2
