"""A sender's clock against ours, from arrivals alone.

A datagram can be late but never early, so the smallest difference between arrival and time stamp
tells the offset, up to the shortest latency.  The rest of the lateness is jitter, which is so taken
out of the time stamps.
"""

import math

_DRIFT = 2e-4
"""The clocks may run apart by this share: the smallest difference is forgotten so fast."""
_RESTART_S = 0.5
"""A clock that differs by more than this from what it was is another clock."""


class SenderClock:
    """Turns a sender's time stamps into our time."""

    __slots__ = ("_last_s", "_offset_s")

    def __init__(self) -> None:
        self._offset_s = math.inf
        self._last_s = -math.inf

    def ours(self, stamp_s: float, received_s: float) -> float:
        """Our time at which a stamp was made, if it took the shortest way here."""
        offset = received_s - stamp_s
        if math.isfinite(self._offset_s):
            self._offset_s += _DRIFT * max(0.0, received_s - self._last_s)
        self._last_s = received_s
        if offset < self._offset_s or offset - self._offset_s > _RESTART_S:
            self._offset_s = offset
        return stamp_s + self._offset_s
