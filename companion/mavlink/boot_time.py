"""Has the autopilot restarted, or its clock been set back?  Its time since boot tells.

It never falls while all is well.  One that has restarted has run for no longer than since it was
heard before that; a time that has fallen and is later than that is of a clock that was set back.
"""

import math
from enum import Enum

_FALL_S = 1.0
"""No packet is this late: a time that lies further back is of another boot, or clock."""
_SLACK_S = 3.0
"""A clock that runs a little fast, and packets that waited on their way."""


class Fall(Enum):
    """Why a time since boot lies before those that came already."""

    RESTART = "restart"
    SET_BACK = "set back"


class BootWatch:
    """Follows the autopilot's time since boot, from whatever message carries it."""

    __slots__ = ("_came_s", "latest_s")

    def __init__(self) -> None:
        self.latest_s = -math.inf
        """The latest time since boot that was seen."""
        self._came_s = -math.inf
        """When that was, by our clock."""

    def fall(self, time_s: float, now_s: float, rate: float = 1.0) -> Fall | None:
        """Take a time since boot.

        Args:
            time_s: the autopilot's, s.
            now_s: when it came, by our clock.
            rate: seconds of the autopilot's clock per second of ours.

        Returns:
            What has happened, if it lies too far back; it is then the latest.
        """
        if not math.isfinite(time_s):
            return None
        fallen = time_s < self.latest_s - _FALL_S
        since_s = rate * (now_s - self._came_s)
        if fallen or time_s >= self.latest_s:
            self.latest_s, self._came_s = time_s, now_s
        if not fallen:
            return None
        return Fall.RESTART if time_s <= since_s + _SLACK_S else Fall.SET_BACK
