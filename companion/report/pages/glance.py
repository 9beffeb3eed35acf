"""What a page says at its top: one sentence that answers, and the figures that matter."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Level = Literal["good", "half", "bad", "none"]
"""As promised; so, with something to look at; not so; nothing to judge."""

_MARKS: dict[Level, str] = {"good": "✓", "half": "!", "bad": "✗", "none": "–"}
_RANK: tuple[Level, ...] = ("none", "good", "half", "bad")


@dataclass(frozen=True, slots=True)
class KeyFigure:
    """A figure of the summary box."""

    name: str
    value: str
    unit: str = ""
    level: Level | None = None
    """Coloured as such; None: as the text."""


@dataclass(frozen=True, slots=True)
class Glance:
    """A summary box."""

    level: Level
    sentence: str
    figures: tuple[KeyFigure, ...] = ()
    reasons: tuple[str, ...] = ()
    """Sentences below the first, the weightiest first."""

    @property
    def mark(self) -> str:
        """The level as one sign, for those who do not see its colour."""
        return _MARKS[self.level]


def worst(levels: Sequence[Level]) -> Level:
    """The weightiest of several; `none` of no level."""
    return max(levels, key=_RANK.index, default="none")
