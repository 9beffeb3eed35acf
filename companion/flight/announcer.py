"""Which changes on the ladder are told to a person, so that nothing is missed and nothing floods.

A change for the worse is told at once, unless the same was told a moment ago; a condition that
comes and goes is told at most once in `QUIET_S`.  The log's records hold every tick anyway.
"""

from typing import NamedTuple

from companion.flight.supervisor import Rung

QUIET_S = 2.0


class Condition(NamedTuple):
    """What is being sent, and why."""

    rung: Rung
    fallback: str
    """Name of the fallback in use; empty for none."""
    reason: str

    @property
    def depth(self) -> int:
        """How far down the ladder: 0 is well."""
        if self.rung is Rung.TRACK:
            return 1 if self.fallback else 0
        return 2 if self.rung is Rung.LEVEL else 3

    def same_as(self, other: "Condition") -> bool:
        """True if a person would not call it a change."""
        return self.depth == other.depth and self.fallback == other.fallback

    @property
    def severity(self) -> str:
        """For a person: "info", "warning" or "error"."""
        return ("info", "warning", "warning", "error")[self.depth]

    def text(self, hand_over: str) -> str:
        """One line for a person.

        Args:
            hand_over: what the vehicle does after a hand-over.
        """
        if self.rung is Rung.HAND_OVER:
            return f"handing over: {self.reason}; {hand_over}"
        if self.rung is Rung.LEVEL:
            return f"level and holding altitude: {self.reason}"
        return f"fallback: {self.fallback}" if self.fallback else "tracking"


WELL = Condition(Rung.TRACK, "", "")


class Announcer:
    """Remembers what was told."""

    def __init__(self) -> None:
        self._told = WELL
        self._told_s: dict[int, float] = {}
        """When each depth was told last."""

    def due(self, condition: Condition, now_s: float) -> bool:
        """True if a condition is to be told now; it then counts as told."""
        if condition.same_as(self._told):
            return False
        newest = max(self._told_s.values(), default=-QUIET_S)
        worse = condition.depth > self._told.depth
        again_soon = now_s - self._told_s.get(condition.depth, -QUIET_S) < QUIET_S
        if now_s - newest < QUIET_S and not (worse and not again_soon):
            return False
        self._told = condition
        self._told_s[condition.depth] = now_s
        return True

    def clear(self) -> None:
        """Begin anew, all well."""
        self._told = WELL
        self._told_s = {}
