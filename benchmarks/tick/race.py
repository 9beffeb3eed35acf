"""Runs contenders over the same ticks, in turn, and keeps the least time of each tick."""

import gc
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.problem import AXES, Problem, TickInput
from companion.control.reference_model import Array

TURN = 96
"""Ticks that a contender does before it is another one's turn."""
_LEAD = 16
"""Ticks that it repeats before, not timed: its code and matrices have left the caches meanwhile."""
_SLOW_REPEATS = 2


@dataclass(frozen=True, slots=True)
class Run:
    """A contender's run over the ticks."""

    time_us: Array
    """(ticks,) the least of the repeats."""
    first_m: Array
    """(repeats, ticks, axes) what it would apply; NaN in repeats that it did not have."""


def pin_to_one_core() -> int | None:
    """Keep this process on the last processor that it may use; None where that can't be had."""
    if not hasattr(os, "sched_setaffinity"):
        return None
    core = max(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {core})
    return core


def race(
    contenders: Sequence[Contender],
    problem: Problem,
    ticks: Sequence[TickInput],
    *,
    repeats: int,
    turn: int = TURN,
) -> tuple[dict[str, Run], dict[str, str]]:
    """Time them, in turns of some ticks each, so that a stall of the host hits all alike.

    Collection of garbage is off meanwhile.  A turn is longer than one tick, and begins with some
    ticks that are not timed, because what the others leave in the caches would be measured too.

    Args:
        contenders: to be timed.
        problem: that they solve.
        ticks: its inputs, in the order of time.
        repeats: of the whole; slow contenders have two of them.
        turn: ticks that one contender does before the next one does the same.

    Returns:
        The runs by name, and why others were left out, by name.
    """
    made: dict[str, Made] = {}
    left_out: dict[str, str] = {}
    for contender in contenders:
        try:
            made[contender.name] = contender.make(problem, ticks)
        except ModuleNotFoundError as error:
            left_out[contender.name] = f"not installed ({error.name or contender.library})"
    count = len(ticks)
    least = {name: np.full(count, np.inf) for name in made}
    slow = {contender.name for contender in contenders if contender.slow}
    first = {name: np.full((repeats, count, AXES), np.nan) for name in made}
    nowhere = np.full(count, np.inf), np.empty((count, AXES))
    collecting = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        for one in made.values():
            _turn(one, range(min(turn, count)), *nowhere)
        for repeat in range(repeats):
            present = {
                name: made[name] for name in made if repeat < _SLOW_REPEATS or name not in slow
            }
            for begin in range(0, count, turn):
                for name, one in present.items():
                    numbers = range(begin, min(begin + turn, count))
                    _turn(one, range(max(0, begin - _LEAD), begin), *nowhere)
                    _turn(one, numbers, least[name], first[name][repeat])
    finally:
        if collecting:
            gc.enable()
    return {name: Run(1e-3 * least[name], first[name]) for name in made}, left_out


def _turn(one: Made, numbers: range, least_ns: Array, first_m: Array) -> None:
    clock, step, prepare = time.perf_counter_ns, one.step, one.prepare
    for k in numbers:
        if prepare is not None:
            prepare(k)
        begin = clock()
        found = step(k)
        took = clock() - begin
        if took < least_ns[k]:
            least_ns[k] = took
        first_m[k] = found
