"""The floor: the closed form for all axes in one product, with no look at any constraint."""

from collections.abc import Sequence

from benchmarks.tick.contenders import Contender, Made
from benchmarks.tick.problem import Problem, TickInput, closed_form_plan
from companion.control.reference_model import Array


def make(problem: Problem, ticks: Sequence[TickInput]) -> Made:
    """Nothing to set up."""

    def step(k: int) -> Array:
        tick = ticks[k]
        first: Array = closed_form_plan(problem, tick)[:, 0] + tick.preview_m[0]
        return first

    return Made(step)


CONTENDERS = [
    Contender("closed form, no check", "floor", make, settings="violates what is constrained")
]
