"""Vehicles near the identified one, over which MPC-L1+ is certified."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from companion.theory.plus_loop import PlusAxisPlant

_Change = Callable[[PlusAxisPlant], PlusAxisPlant]


@dataclass(frozen=True, slots=True)
class Member:
    """One way in which the vehicle differs from what was identified."""

    name: str
    change: _Change
    hard: bool = False
    """Of those that the learning in flight is there for, which is not in the certificate."""
    told_s: float = 0.0
    """How much of the additional delay the law is told, as a link's delay is measured."""


def lag(factor: float) -> _Change:
    """The response lags more by a factor: ωn is divided by its root, ζ multiplied with it."""
    root = float(factor) ** 0.5

    def change(plant: PlusAxisPlant) -> PlusAxisPlant:
        a = plant.actuation
        slower = replace(
            a, natural_frequency_rad_s=a.natural_frequency_rad_s / root, damping=a.damping * root
        )
        return replace(plant, actuation=slower)

    return change


def slow(factor: float) -> _Change:
    """The response is stretched in time by a factor: ωn is divided by it, ζ stays."""
    return lambda plant: replace(plant, actuation=plant.actuation.lagging(factor))


def late(seconds: float) -> _Change:
    """The dead time is longer."""

    def change(plant: PlusAxisPlant) -> PlusAxisPlant:
        a = plant.actuation
        return replace(plant, actuation=replace(a, delay_s=a.delay_s + seconds))

    return change


def gain(factor: float) -> _Change:
    """A command does more, and the measured tilt shows it."""
    return lambda plant: replace(plant, gain=factor)


def push(factor: float) -> _Change:
    """Tilt and thrust push more than they say."""
    return lambda plant: replace(plant, push=factor)


def drag(factor: float) -> _Change:
    """More linear drag."""
    return lambda plant: replace(plant, drag_1_s=factor * plant.drag_1_s)


def combined(*changes: _Change) -> _Change:
    """All of them."""

    def change(plant: PlusAxisPlant) -> PlusAxisPlant:
        for one in changes:
            plant = one(plant)
        return plant

    return change


FAMILY = (
    Member("lag − 25 %", lag(0.75)),
    Member("lag + 25 %", lag(1.25)),
    Member("slow + 25 %", slow(1.25)),
    Member("delay + 20 ms", late(0.020)),
    Member("gain − 15 %", gain(0.85)),
    Member("gain + 15 %", gain(1.15)),
    Member("push − 15 %", push(0.85)),
    Member("push + 15 %", push(1.15)),
    Member("drag × 2", drag(2.0)),
    Member("lag + 50 %", lag(1.5), hard=True),
    Member("slow + 50 %", slow(1.5), hard=True),
    Member("delay + 40 ms", late(0.040), hard=True),
    Member("delay + 40 ms, told", late(0.040), told_s=0.040),
    Member("lag + 25 %, + 20 ms, drag × 2", combined(lag(1.25), late(0.020), drag(2.0)), hard=True),
)
"""In the order in which they are told."""
