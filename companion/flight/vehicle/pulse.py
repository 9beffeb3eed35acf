"""The vehicle's heartbeats: the only message that says whether it is armed.

An autopilot whose other messages go on while its heartbeats do not has been told to stop them, or
its link drops just these.  The companion would fly on, blind to a disarming and to a landing.
"""

import math
from collections.abc import Callable

from companion.flight.vehicle.losses import Losses

MISSING_S = 3.5
"""Three in a row, and half a second for the last to be late; by the autopilot's clock."""
_LATE_S = 0.5
_BY_CHANCE = 1.0e-5
"""On a link that loses packets more are awaited: all may be lost by chance with this probability
alone."""
_PAUSE_S = 1.0
"""A silence this long is the link's: from its end on heartbeats are missed anew."""


class Pulse:
    """Notes when heartbeats and other messages come.

    Args:
        loop_seconds: makes the loop's seconds of the autopilot's.
        losses: of the vehicle's packets.
    """

    __slots__ = ("_heard_s", "_loop_seconds", "_losses", "_since_s")

    def __init__(self, loop_seconds: Callable[[float], float], losses: Losses) -> None:
        self._loop_seconds = loop_seconds
        self._losses = losses
        self._heard_s = -math.inf
        self._since_s = math.inf
        """The last heartbeat, or when the vehicle was heard again after a silence."""

    def on_message(self, now_s: float) -> None:
        """Anything has come from the vehicle, at the loop's time."""
        if now_s - self._heard_s > self._loop_seconds(_PAUSE_S):
            self._since_s = now_s
        self._heard_s = now_s

    def on_heartbeat(self, now_s: float) -> None:
        """A heartbeat has come from it."""
        self._heard_s = self._since_s = now_s

    def forget(self) -> None:
        """The autopilot has restarted."""
        self._heard_s, self._since_s = -math.inf, math.inf

    @property
    def missing_after_s(self) -> float:
        """After so long without a heartbeat they have stopped, s of the autopilot's clock."""
        return max(MISSING_S, self._losses.in_a_row(_BY_CHANCE) + _LATE_S)

    def missing(self, now_s: float) -> bool:
        """True if other messages come, and heartbeats have not for `missing_after_s`."""
        if now_s - self._heard_s > self._loop_seconds(_PAUSE_S):
            return False
        return now_s - self._since_s > self._loop_seconds(self.missing_after_s)
