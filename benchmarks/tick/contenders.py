"""What races: one way of solving a tick, behind one interface; one file each in this folder."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Literal

from benchmarks.tick.problem import Problem, TickInput
from companion.control.reference_model import Array

Kind = Literal["flight", "floor", "ours", "library"]
"""The whole tick that flies; the closed form alone; our check-then-solve; a library by itself."""

Step = Callable[[int], Array]
"""Solves the tick of this number: references to apply (axes,), ENU m.  This is what is timed."""


@dataclass(frozen=True, slots=True)
class Made:
    """A contender set up for a problem and its ticks."""

    step: Step
    prepare: Callable[[int], None] | None = None
    """Before each step, not timed: what another part of a flight would have done."""


@dataclass(frozen=True, slots=True)
class Contender:
    """A way of solving a tick."""

    name: str
    kind: Kind
    make: Callable[[Problem, Sequence[TickInput]], Made]
    """Raises ModuleNotFoundError where its library is not installed."""
    library: str = ""
    """Distribution whose version is stated."""
    settings: str = ""
    """Tolerances and the like, in words."""
    slow: bool = False
    """Takes milliseconds at long horizons."""


_FILES = (
    "flight",
    "closed_form",
    "ours",
    "osqp_sparse",
    "osqp_condensed",
    "daqp_condensed",
    "piqp_condensed",
    "proxqp_condensed",
    "clarabel_condensed",
    "quadprog_condensed",
    "cplex_condensed",
)


def contenders() -> list[Contender]:
    """All, in the order in which they are told."""
    found: list[Contender] = []
    for name in _FILES:
        found += import_module(f"benchmarks.tick.{name}").CONTENDERS
    return found
