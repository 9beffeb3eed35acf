"""When to try again, and how a lost peer shows."""

SILENT_AFTER_S = 3.0
"""A stream on which nothing came for this long is taken for dead: three heartbeats are missing.

Shorter than the silence after which a flight gives the link up (`timeouts.link_lost_s`), so that
a half-open connection is made anew in time.
"""
BLOCKED_AFTER_S = 1.0
"""A stream that has taken nothing for this long is cut: what waits in it is stale by now."""
_FIRST_S = 0.1
_LONGEST_S = 2.0


class Backoff:
    """Waits of 0.1 s, doubling to 2 s."""

    __slots__ = ("_next_s",)

    def __init__(self) -> None:
        self._next_s = _FIRST_S

    def next_s(self) -> float:
        """How long to wait before the next attempt."""
        wait_s = self._next_s
        self._next_s = min(2.0 * wait_s, _LONGEST_S)
        return wait_s

    def reset(self) -> None:
        """Begin anew: the peer was there."""
        self._next_s = _FIRST_S
