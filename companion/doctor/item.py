"""One line of what the doctor says."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Health(StrEnum):
    """How a line weighs; each is worse than the one before."""

    OK = "ok"
    NOTE = "note"
    """Worth knowing; it stands against nothing, or only against what is not used."""
    PROBLEM = "problem"
    """Something will not work, or not as promised."""


@dataclass(frozen=True, slots=True)
class Item:
    """One thing that was looked at."""

    subject: str
    """What, in a word or two."""
    found: str
    """What it is, with its figure."""
    health: Health = Health.OK
    remedy: str = ""
    """What to do about it; empty when there is nothing to do."""


def worst(items: Iterable[Item]) -> Health:
    """The worst of all; `OK` of none."""
    order = list(Health)
    return max((item.health for item in items), key=order.index, default=Health.OK)
