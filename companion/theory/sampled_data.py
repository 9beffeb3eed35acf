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
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from companion.control import delay
from companion.control.interfaces import InnerController, OuterController
from companion.control.matrix_exponential import matrix_exponential
from companion.control.mpc import MpcRecord
from companion.control.reference_model import Array
from companion.control.transfer_function import TransferFunction
from companion.theory.plant import AxisPlant, ComplexArray

_SMALL = 1e-4
"""Of the basis vectors: far from every limit of the laws."""
_LONGEST_PERIOD = 80
"""Samples."""
_NOT_READ = ("plan_m",)
"""Kept for a fallback of the MPC; the closed form does not read it."""


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
class _HeldPlant:
    """One axis over one sample: ``x+ = Φ x + late u(k-d-1) + early u(k-d)``, x with position."""

    phi: Array
    late: Array
    early: Array
    whole: int
    """d: whole samples of delay."""


@dataclass(slots=True)
class _State:
    """All that the loop carries from period to period; arrays begin with the axis."""

    plant: Array
    """(axes, states): velocity first, position last."""
    sent: Array
    """(axes, samples): inputs on their way, the newest first."""
    inner: Any
    outer: Any
    references: Array
    """(axes, references): r2 of the last plans, the newest first."""


def period_map(loop: SampledLoop) -> PeriodMap:
    """The matrix of one period for each axis.

    Raises:
        ValueError: the rates have no common multiple within a reasonable time, or a constraint
            of the outer controller acts on a small deviation.
    """
    plans = _plan_ticks(loop)
    held = [_hold(loop, axis) for axis in range(len(loop.plants))]
    # The laws' memories have their final shape after a first period, of which nothing comes.
    rest = _run(loop, held, plans, _at_rest(loop, held))
    size = _pack(rest).shape[1]
    columns = []
    for k in range(size):
        vector = np.zeros((len(held), size))
        vector[:, k] = _SMALL
        state = _run(loop, held, plans, _unpack(rest, vector))
        columns.append(_pack(state) / _SMALL)
    ticks = plans[-1]
    return PeriodMap(np.stack(columns, axis=2), ticks * loop.sample_s)


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


def _hold(loop: SampledLoop, axis: int) -> _HeldPlant:
    plant, h = loop.plants[axis], loop.sample_s
    total = plant.delay_s + float(loop.more_delay_s[axis])
    whole = math.floor(total / h + 1e-9)
    phi, late, early = _held(plant.rational, h, max(0.0, round(total - whole * h, 9)))
    factor = float(loop.gain[axis])
    return _HeldPlant(phi, factor * late, factor * early, whole)


@lru_cache(maxsize=1024)
def _held(rational: TransferFunction, h: float, rest: float) -> tuple[Array, Array, Array]:
    """Φ and the inputs' columns of a step h within which the input changes after `rest`."""
    a, b, _ = rational.state_space()
    n = len(b)
    system = np.zeros((n + 2, n + 2))  # velocity ..., position, input
    system[:n, :n], system[:n, n + 1] = a, b
    system[n, 0] = 1.0
    first, second = matrix_exponential(system * rest), matrix_exponential(system * (h - rest))
    keep = n + 1
    late = second[:keep, :keep] @ first[:keep, -1]
    return (second @ first)[:keep, :keep], late, second[:keep, -1]


def _at_rest(loop: SampledLoop, held: list[_HeldPlant]) -> _State:
    axes = len(held)
    still = np.zeros(axes)
    inner, _ = loop.inner.start(still, still, still)
    outer = loop.outer.start(still) if loop.outer is not None else None
    references = 0 if loop.outer is None else 1
    if loop.outer is not None and loop.outer.model is not None:
        references += math.ceil(loop.known_delay_s / max(loop.outer.period_s, loop.sample_s)) + 1
    return _State(
        plant=np.zeros((axes, max(len(plant.late) for plant in held))),
        sent=np.zeros((axes, 1 + max(plant.whole for plant in held))),
        inner=inner,
        outer=outer,
        references=np.zeros((axes, references)),
    )


def _run(loop: SampledLoop, held: list[_HeldPlant], plans: list[int], state: _State) -> _State:
    """One period, from its first plan on."""
    axes, ticks = len(held), plans[-1]
    # Plans before this period, the newest first, each with its tick.
    known = state.references.shape[1]
    earlier = [plans[-2 - k % (len(plans) - 1)] - ticks * (1 + k // (len(plans) - 1))
               for k in range(known)]  # fmt: skip
    past = [(earlier[k], state.references[:, k]) for k in range(known)]
    position_at = [len(plant.late) - 1 for plant in held]
    x, sent = np.zeros_like(state.plant), state.sent
    for i, plant in enumerate(held):  # an axis of fewer states than another has none behind them
        x[i, : len(plant.late)] = state.plant[i, : len(plant.late)]
    inner, outer = state.inner, state.outer
    for tick in range(ticks):
        velocity = x[:, 0].copy()
        position = x[np.arange(axes), position_at]
        if tick in plans and loop.outer is not None:
            since_s = (tick - past[0][0]) * loop.sample_s
            outer, r2 = _plan(loop, outer, past, position, velocity, tick, since_s)
            past.insert(0, (tick, r2))
        r2 = past[0][1] if past else np.zeros(axes)
        inner, record = loop.inner.step(inner, r2, position, velocity, loop.sample_s)
        inner = loop.inner.with_applied(inner, record.u)
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
    return _State(x, sent, inner, outer, references)


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


def _pack(state: _State) -> Array:
    """(axes, states)."""
    parts = [state.plant, state.sent, state.references]
    parts += [leaf.reshape(len(leaf), -1) for leaf in _leaves((state.inner, state.outer))]
    return np.concatenate(parts, axis=1)


def _unpack(like: _State, vector: Array) -> _State:
    """The state that packs to a vector."""
    cut = 0

    def take(leaf: Array) -> Array:
        nonlocal cut
        width = leaf.size // len(leaf)
        part = vector[:, cut : cut + width].reshape(leaf.shape)
        cut += width
        return part

    plant, sent, references = take(like.plant), take(like.sent), take(like.references)
    return _State(plant, sent, _filled(like.inner, take), _filled(like.outer, take), references)


def _leaves(memory: Any) -> list[Array]:  # noqa: ANN401 - of any law
    """The arrays of a memory, however its dataclasses are nested."""
    if isinstance(memory, np.ndarray):
        return [memory]
    if isinstance(memory, tuple):
        return [leaf for part in memory for leaf in _leaves(part)]
    if not is_dataclass(memory):
        return []
    return [leaf for name in _names(memory) for leaf in _leaves(getattr(memory, name))]


def _filled(memory: Any, take: Callable[[Array], Array]) -> Any:  # noqa: ANN401
    """A memory with other arrays, in the order of `_leaves`."""
    if isinstance(memory, np.ndarray):
        return take(memory)
    if not is_dataclass(memory) or isinstance(memory, type):
        return memory
    return replace(
        memory, **{name: _filled(getattr(memory, name), take) for name in _names(memory)}
    )


def _names(memory: Any) -> list[str]:  # noqa: ANN401
    return [field.name for field in fields(memory) if field.name not in _NOT_READ]
