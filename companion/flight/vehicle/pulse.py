"""The vehicle's heartbeats: the only message that says whether it is armed.

An autopilot whose other messages go on while its heartbeats do not has been told to stop them, or
its link drops just these.  The companion would fly on, blind to a disarming and to a landing.
"""

import math
from collections.abc import Callable

MISSING_S = 3.5
"""Three in a row, and half a second for the last to be late; by the autopilot's clock."""
_PAUSE_S = 1.0
"""A silence this long is the link's: from its end on heartbeats are missed anew."""


class Pulse:
    """Notes when heartbeats and other messages come.

    Args:
        loop_seconds: makes the loop's seconds of the autopilot's.
    """

    __slots__ = ("_heard_s", "_loop_seconds", "_since_s")

    def __init__(self, loop_seconds: Callable[[float], float]) -> None:
        self._loop_seconds = loop_seconds
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

    def missing(self, now_s: float) -> bool:
        """True if other messages come, and heartbeats have not for `MISSING_S`."""
        if now_s - self._heard_s > self._loop_seconds(_PAUSE_S):
            return False
        return now_s - self._since_s > self._loop_seconds(MISSING_S)
