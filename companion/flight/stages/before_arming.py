"""What others may do to a vehicle that the companion has not armed yet, and what ends the flight.

A vehicle that somebody else arms is theirs, whatever they do with it; and a mode that somebody else
chooses is meant.  Only what an autopilot does to its own mode while it boots is answered.
"""

import asyncio
import math

from companion.flight.errors import FlightRefusedError
from companion.flight.stages.crew import Flight, FlightScope
from companion.flight.vehicle.connection import Connection

_BOOT_OVERWRITES_WITHIN_S = 3.0
_BOOTED = 3
"""MAV_STATE_STANDBY: what is less is booting or calibrating."""
_MOST_ANSWERS_BOOTING = 3
_LOOK_AT_MODES = "Look at the mode switch of the remote control and at other ground stations."


def used_by_others(flight: Flight, mode: str | None = None) -> FlightRefusedError | None:
    """Why the flight is refused because of what somebody else does; None if nobody does.

    Args:
        flight: that has not been armed by the companion.
        mode: the one to be armed in, once the vehicle is ready in it.
    """
    connection = flight.connection
    if flight.scope is not FlightScope.WHOLE or connection.reports.custom_mode is None:
        return None
    if connection.reports.armed:
        return FlightRefusedError(
            f"The vehicle is armed already (mode {connection.mode}), and not by the companion. It "
            "takes over no flight that it did not start: land and disarm, then start again."
        )
    if mode is not None and connection.mode != mode:
        return _chosen_by_others(connection.mode, mode)
    return None


class ModeKeeper:
    """Tells whether a mode that gave way to another one may be asked for again.

    ArduPilot overwrites a mode once, when its boot reads the mode switch.
    """

    def __init__(self, connection: Connection, mode: str) -> None:
        """Watch over a mode that is to be armed in."""
        self._connection = connection
        self._mode = mode
        self._held_since_s = math.inf
        """Since when it is in the mode, booted; infinity while it is not."""
        self._confirmed = False
        self._answers = 0

    def look(self) -> None:
        """Take note of the mode that is reported now."""
        connection = self._connection
        if connection.mode != self._mode:
            return
        self._confirmed = True
        if connection.reports.system_status < _BOOTED:
            self._held_since_s = math.inf
        elif self._held_since_s == math.inf:
            self._held_since_s = asyncio.get_running_loop().time()

    def gave_way(self) -> bool:
        """It is in another mode, and is to be asked for.

        Returns:
            True if it has been in the mode before.

        Raises:
            FlightRefusedError: no; somebody else has chosen that other one.
        """
        if not self._confirmed:
            return False
        held_s = asyncio.get_running_loop().time() - self._held_since_s
        if self._connection.reports.system_status < _BOOTED:
            may = self._answers < _MOST_ANSWERS_BOOTING
        else:
            may = self._answers == 0 and held_s <= _BOOT_OVERWRITES_WITHIN_S
        if not may:
            raise _chosen_by_others(self._connection.mode, self._mode)
        self._answers += 1
        self._confirmed = False
        self._held_since_s = math.inf
        return True


def _chosen_by_others(chosen: str, mode: str) -> FlightRefusedError:
    return FlightRefusedError(
        f"Somebody else chose mode {chosen} before arming, in place of {mode}, in which the "
        f"companion would have armed: it does not fight for it. {_LOOK_AT_MODES}"
    )
