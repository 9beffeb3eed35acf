"""Has the autopilot restarted?  Its time since boot tells: it never falls otherwise."""

import math

_FALL_S = 1.0
"""No packet is this late: a time that lies further back is of another boot."""


class BootWatch:
    """Follows the autopilot's time since boot, from whatever message carries it."""

    __slots__ = ("latest_s",)

    def __init__(self) -> None:
        self.latest_s = -math.inf
        """The latest time since boot that was seen."""

    def restarted(self, time_s: float) -> bool:
        """Take a time since boot, s; True if it can only be that of another boot."""
        if not math.isfinite(time_s):
            return False
        if time_s < self.latest_s - _FALL_S:
            self.latest_s = time_s
            return True
        self.latest_s = max(self.latest_s, time_s)
        return False
