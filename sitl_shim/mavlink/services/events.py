"""The events interface: what the autopilot tells programs, and tells again when asked.

https://mavlink.io/en/services/events.html
"""

from collections import deque
from collections.abc import Callable, Mapping

from sitl_shim.mavlink.event_messages import (
    current_sequence_message,
    error_message,
    event_message,
)
from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.wire import Message

_FIRST = 65_527
"""PX4's first sequence number: near the end, so that clients meet the overflow soon."""
_MODULO = 1 << 16
_KEPT = 64
_SEQUENCE_PERIOD_US = 3_040_000
_MOST_AGAIN = 16
"""Events that are told again for one request."""


class Events:
    """Events on all links.

    Args:
        context: of the vehicle.
    """

    def __init__(self, context: Context) -> None:
        self._context = context
        self._speaks = context.personality.events
        self._sequence = _FIRST - 1
        """Of the newest event."""
        self._kept: deque[tuple[int, Message]] = deque(maxlen=_KEPT)

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        return {"REQUEST_EVENT": self._request} if self._context.personality.events else {}

    def step(self, now_us: int) -> int:
        """Send what happened, and now and then the newest sequence number.

        Returns:
            0: it looks at every tick whether something happened.
        """
        context = self._context
        events = context.sim.autopilot.take_events()
        if not self._speaks:
            return 0
        for event in events:
            self._sequence = (self._sequence + 1) % _MODULO
            message = event_message(
                event.id, context.sim.stamp_ms, self._sequence, event.levels, event.arguments
            )
            self._kept.append((self._sequence, message))
            for link in context.links:
                link.send(message)
        if now_us % _SEQUENCE_PERIOD_US == 0 and self._kept:
            for link in context.links:
                link.send(current_sequence_message(self._sequence))
        return 0

    def _request(self, link: int, message: Message) -> None:
        if not self._context.concerns(message):
            return
        count = (message.last_sequence - message.first_sequence) % _MODULO + 1
        kept = dict(self._kept)
        oldest = self._kept[0][0] if self._kept else self._sequence
        sender = (message.get_srcSystem(), message.get_srcComponent())
        for offset in range(min(count, _MOST_AGAIN)):
            sequence = (message.first_sequence + offset) % _MODULO
            again = kept.get(sequence)
            if again is None:
                again = error_message(sequence, oldest % _MODULO, sender)
            self._context.links[link].send(again)
