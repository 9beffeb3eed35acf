"""What the companion's own heartbeat says of it: the truth about who is flying, and how well.

STANDBY before and after, and while the autopilot or a person flies.  ACTIVE while the controller
flies and is well.  CRITICAL while something less than its optimum is sent (a fallback, or level).
EMERGENCY after the companion has had to hand the vehicle over, until it flies or lands again.

A heartbeat is sent once a second, ticks come a hundred times as often: each heartbeat tells the
worst since the one before.
"""

from companion.mavlink.messages import VehicleStateOfHealth


class Health:
    """MAV_STATE of our heartbeat."""

    __slots__ = ("_state", "_troubled")

    def __init__(self) -> None:
        self._state = VehicleStateOfHealth.STANDBY
        self._troubled = False

    def standby(self) -> None:
        """Somebody else flies, or nobody."""
        self._state = VehicleStateOfHealth.STANDBY
        self._troubled = False

    def active(self, *, troubled: bool = False) -> None:
        """The controller flies; `troubled` if with less than its optimum."""
        self._state = VehicleStateOfHealth.ACTIVE
        self._troubled = self._troubled or troubled

    def emergency(self) -> None:
        """The companion has given the vehicle up."""
        self._state = VehicleStateOfHealth.EMERGENCY

    def say(self) -> VehicleStateOfHealth:
        """What the heartbeat that is sent now says."""
        troubled, self._troubled = self._troubled, False
        if self._state is VehicleStateOfHealth.ACTIVE and troubled:
            return VehicleStateOfHealth.CRITICAL
        return self._state
