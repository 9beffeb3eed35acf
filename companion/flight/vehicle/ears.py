"""Listening to a vehicle for a while: which messages come, when, and what the newest says."""

import math
import statistics
from collections.abc import Iterable
from itertools import pairwise

from companion.flight.vehicle.connection import Connection
from companion.mavlink.codec import decode
from companion.mavlink.dialect import Message
from companion.mavlink.framing import Frame


class Ears:
    """Hears some kinds of messages of a connection's vehicle, until `close`."""

    def __init__(self, connection: Connection, message_ids: Iterable[int], begun_s: float) -> None:
        """Begin to listen.

        Args:
            connection: to whose vehicle.
            message_ids: to what.
            begun_s: the loop's time now.
        """
        self._connection = connection
        self._begun_s = begun_s
        self._times: dict[int, list[float]] = {int(i): [] for i in message_ids}
        self._newest: dict[int, Frame] = {}
        for message_id in self._times:
            connection.listeners.setdefault(message_id, []).append(self._take)

    def close(self) -> None:
        """Listen no more."""
        for message_id in self._times:
            listeners = self._connection.listeners[message_id]
            if self._take in listeners:
                listeners.remove(self._take)

    def newest(self, message_id: int) -> Message | None:
        """The last of a kind, decoded; None if none came."""
        frame = self._newest.get(int(message_id))
        return None if frame is None else decode(frame)

    def count(self, message_id: int) -> int:
        """How many of a kind came."""
        return len(self._times[int(message_id)])

    def rate_hz(self, message_id: int, now_s: float) -> float:
        """How often one comes: by the mean time from one to the next.

        Of one alone, and of many that came all at once after a pause: how many in all the time.
        """
        times = self._times[int(message_id)]
        if len(times) > 1 and times[-1] > times[0]:
            return (len(times) - 1) / (times[-1] - times[0])
        return len(times) / (now_s - self._begun_s)

    def longest_gap_s(self, message_id: int, now_s: float) -> float:
        """Longest time without one, from the beginning until now."""
        times = [self._begun_s, *self._times[int(message_id)], now_s]
        return max(b - a for a, b in pairwise(times))

    def jitter_s(self, message_id: int) -> float:
        """Standard deviation of the intervals; NaN of fewer than three messages."""
        times = self._times[int(message_id)]
        if len(times) < 3:
            return math.nan
        return statistics.pstdev(b - a for a, b in pairwise(times))

    def _take(self, frame: Frame, received_s: float) -> None:
        self._times[frame.message_id].append(received_s)
        self._newest[frame.message_id] = frame
