"""How many of the vehicle's packets are lost of late, and what patience that asks for.

MAVLink numbers the packets of a sender.  What is missed now and then on a good link is missed all
the time on a bad one: a question is then repeated more often before it counts as refused, and more
heartbeats are awaited before they count as stopped.
"""

import math
from dataclasses import replace

from companion.mavlink.exchange import Patience

_FULL_CIRCLE = 256
_LONGEST_GAP = 16
"""A longer one is a pause of the link, or another sender: no loss by chance."""
_MEMORY = 500.0
"""Packets after which something is forgotten (to 1/e)."""
_KEEP = 1.0 - 1.0 / _MEMORY
_FEW = 50.0
"""So many are taken for received before the first: a single early loss says little."""
_UNLUCKY = 1.0e-4
"""Chance of bad luck alone that is put up with, of a question."""
_WORST = 0.5
"""No patience helps beyond this share."""


class Losses:
    """Follows the sequence numbers of one sender."""

    __slots__ = ("_lost", "_received", "_sequence")

    def __init__(self) -> None:
        self._sequence: int | None = None
        self._received = _FEW
        self._lost = 0.0

    def on_packet(self, sequence: int) -> None:
        """Take the number of a packet that has come."""
        self._received = self._received * _KEEP + 1.0
        self._lost *= _KEEP
        if self._sequence is not None:
            gap = (sequence - self._sequence - 1) % _FULL_CIRCLE
            if gap <= _LONGEST_GAP:
                self._lost += gap
            elif _FULL_CIRCLE - gap <= _LONGEST_GAP:
                # It was overtaken, and counted as lost when that came; or it came twice.
                self._lost = max(0.0, self._lost - (gap != _FULL_CIRCLE - 1))
                return
        self._sequence = sequence

    @property
    def share(self) -> float:
        """Of the packets that the vehicle sends, of late."""
        return self._lost / (self._received + self._lost)

    def packets_in_a_row(self, chance: float) -> int:
        """How many must fail to come in a row for bad luck alone to have no more than a chance."""
        return _in_a_row(min(_WORST, self.share), chance)

    def answers_in_a_row(self, chance: float) -> int:
        """The same of answers to questions: either way loses packets, as many as the other."""
        return _in_a_row(1.0 - (1.0 - min(_WORST, self.share)) ** 2, chance)

    def patience(self, usual: Patience) -> Patience:
        """A patience with a question: more of it where packets are lost."""
        return replace(usual, attempts=max(usual.attempts, self.answers_in_a_row(_UNLUCKY)))

    def forget(self) -> None:
        """The sender has restarted, and numbers anew."""
        self._sequence = None


def _in_a_row(share: float, chance: float) -> int:
    return max(1, math.ceil(math.log(chance) / math.log(max(1e-9, share))))
