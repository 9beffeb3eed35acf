"""Which changes on the ladder are told to a person, so that nothing is missed and nothing floods.

A change for the worse is told at once, unless the same was told a moment ago; one for the better
when it has lasted.  Remarks that differ in their numbers alone are the same.  The log's records
hold every tick anyway.
"""

import math
import re
from typing import NamedTuple

from companion.flight.setpoints.supervisor import Rung

QUIET_S = 2.0
"""The same is not told twice within this."""
SETTLED_S = 1.0
"""So long must all have been better before that is told."""
_NUMBER = re.compile(r"\d+(\.\d+)?")


_FALLBACK_DEPTH = {"": 0, "shifted plan": 1}


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
            return _FALLBACK_DEPTH.get(self.fallback, 2)
        return 3 if self.rung is Rung.LEVEL else 4

    @property
    def severity(self) -> str:
        """For a person: "info", "warning" or "error"."""
        return ("info", "warning", "warning", "warning", "error")[self.depth]

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
        self._better_since_s: float | None = None
        self._remarked_s: dict[str, float] = {}
        """When each remark was told last, by its text without numbers."""

    def due(self, condition: Condition, now_s: float) -> bool:
        """True if a condition is to be told now; it then counts as told."""
        depth, told = condition.depth, self._told.depth
        if depth < told:
            if self._better_since_s is None:
                self._better_since_s = now_s
            if now_s - self._better_since_s < SETTLED_S:
                return False
        else:
            self._better_since_s = None
            if depth == told or now_s - self._told_s.get(depth, -QUIET_S) < QUIET_S:
                return False
        self._told = condition
        self._told_s[depth] = now_s
        self._better_since_s = None
        return True

    def due_remark(self, remark: str, now_s: float) -> bool:
        """True if a remark is to be told now; it then counts as told."""
        kind = _NUMBER.sub("#", remark)
        if now_s - self._remarked_s.get(kind, -math.inf) < QUIET_S:
            return False
        self._remarked_s[kind] = now_s
        return True

    def clear(self) -> None:
        """Begin anew, all well."""
        self._told = WELL
        self._told_s = {}
        self._better_since_s = None
        self._remarked_s = {}
