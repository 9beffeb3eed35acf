"""Parameters that are called otherwise in other releases of an autopilot."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple


class Named(NamedTuple):
    """A parameter's value, and the name by which this autopilot has it."""

    name: str
    value: float


def first_of(parameters: Mapping[str, float], names: Iterable[str]) -> Named | None:
    """The first of these names that the autopilot has; None if it has none of them."""
    for name in names:
        if name in parameters:
            return Named(name, parameters[name])
    return None
