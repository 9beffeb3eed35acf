"""The ground station's heartbeat: heard, lost, and what is done about it."""

from sitl_shim.autopilot.ardupilot.modes import Mode
from sitl_shim.autopilot.parameters import ParameterStore

_RETURN, _LAND, _BRAKE = (1, 2, 3, 4, 6), 5, 7
"""Values of FS_GCS_ENABLE; a return by a known path is a plain return here."""


class GroundStationWatch:
    """Notices when the ground station falls silent; one that was never heard is not missed.

    Args:
        parameters: FS_GCS_ENABLE and FS_GCS_TIMEOUT.
    """

    __slots__ = ("_heard_us", "_parameters", "lost")

    def __init__(self, parameters: ParameterStore) -> None:
        self._parameters = parameters
        self._heard_us: int | None = None
        self.lost = False

    def hear(self, time_us: int) -> bool:
        """A heartbeat came in; True if the station was lost until now."""
        self._heard_us = time_us
        was_lost, self.lost = self.lost, False
        return was_lost

    def falls_silent(self, time_us: int) -> bool:
        """Whether it is lost from now on."""
        since = self._heard_us
        if since is None or self.lost or not self._parameters["FS_GCS_ENABLE"]:
            return False
        self.lost = time_us - since > self._parameters["FS_GCS_TIMEOUT"] * 1e6
        return self.lost

    def modes(self) -> tuple[Mode, ...]:
        """What to fly instead: the first of these that can be entered."""
        action = self._parameters.integer("FS_GCS_ENABLE")
        if action == _BRAKE:
            return (Mode.BRAKE, Mode.LAND)
        return (Mode.RTL, Mode.LAND) if action in _RETURN else (Mode.LAND,)
