"""What ends arming: nothing is armed again that has disarmed, by whomever, or has restarted."""

import asyncio
import math

from companion.flight.errors import DisarmedError
from companion.flight.vehicle.connection import Connection

_FOLLOWS_S = 0.5
"""A HEARTBEAT that comes so long after the acknowledgement was made after arming."""
_ARMED_TEXTS = ("armed by ", "arming motors")
"""How the STATUSTEXTs begin by which PX4 and ArduPilot say that they have armed."""
_DISARMED_TEXTS = ("disarmed by ", "disarming motors")


class ArmingWatch:
    """Follows what HEARTBEATs, and texts, say of arming while the companion arms.

    A text may be all that arrives of an arming that somebody has undone within a second.
    """

    def __init__(self, connection: Connection) -> None:
        """Watch from now on: the vehicle is disarmed."""
        self._connection = connection
        self._restarts = connection.restarts
        self._heartbeats = connection.reports.heartbeats
        self._said = connection.reports.said
        self._seen_armed = False
        self._said_disarmed = False
        self._accepted_s = math.inf

    def accepted(self) -> None:
        """Arming has been accepted just now: the next HEARTBEAT should say armed."""
        self._accepted_s = min(self._accepted_s, asyncio.get_running_loop().time())

    def look(self) -> DisarmedError | None:
        """Why arming is over; None while it is not.  To be called with every HEARTBEAT."""
        connection, reports = self._connection, self._connection.reports
        fresh = reports.heartbeats > self._heartbeats
        self._heartbeats = reports.heartbeats
        if connection.restarts > self._restarts:
            return DisarmedError(
                "The autopilot restarted while the companion armed it. It is not armed again."
            )
        self._read_texts()
        if reports.armed:
            self._seen_armed = True
            if not self._said_disarmed:
                return None
        late_s = asyncio.get_running_loop().time() - self._accepted_s
        if self._said_disarmed or self._seen_armed or (fresh and late_s >= _FOLLOWS_S):
            return DisarmedError(
                "The vehicle was disarmed as soon as it was armed, and not by the companion. It "
                "is not armed again: find out what disarmed it, then start anew."
            )
        return None

    def _read_texts(self) -> None:
        reports = self._connection.reports
        new = reports.said - self._said
        self._said = reports.said
        for text in reports.texts[-new:] if new else ():
            if text.lower().startswith(_ARMED_TEXTS):
                self.accepted()
            elif text.lower().startswith(_DISARMED_TEXTS):
                self._said_disarmed = True
