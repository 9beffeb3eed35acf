"""The flight's end of the live view: what is recorded goes to the page's process, or nowhere.

Nothing is decoded or reckoned here, and nothing waited for: what the other process does not take
at once is dropped, but for the few records that the picture stands on.
"""

import base64
import contextlib
import errno
import socket
from collections import deque
from collections.abc import Mapping
from typing import Any

import orjson

from companion.flight.records import CONFIGURATION, CONTROL, EVENT, INPUT

INTERVAL_S = 0.05
"""Between two handings over, by the caller's time."""
RECORD, PACKET, END = "record", "packet", "end"
"""Kinds of items: (kind, time, topic, values), (kind, time, base64), (kind, time, outcome)."""

_MAVLINK_2 = 0xFD
_SENDER_AT, _HEADER_BYTES = 5, 10
"""A header ends with system, component and message id (3 bytes)."""
_SHOWN = frozenset((0, 1, 30, 31, 32, 250, 331))
"""HEARTBEAT, SYS_STATUS, ATTITUDE, ATTITUDE_QUATERNION, LOCAL_POSITION_NED, DEBUG_VECT, ODOMETRY:
https://mavlink.io/en/messages/common.html."""
_MOST_TICKS = 50
_MOST_KEPT = 300
_MOST_SENDERS = 64
_SOCKET_BYTES = 1 << 20
_LAST_WORD_S = 1.0
_ANOTHER_TIME = (errno.EAGAIN, errno.EMSGSIZE, errno.ENOBUFS, errno.ENOMEM)
"""The socket is full, the datagram too long for the system, or memory is short for a moment."""


def datagram_pair() -> tuple[socket.socket, socket.socket]:
    """The flight's and the page's end of a way that keeps whole datagrams apart.

    Raises:
        OSError: there are no more.
    """
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.setblocking(False)
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SOCKET_BYTES)
    return ours, theirs


class LiveFeed:
    """A `LogListener` that hands on what a page shows."""

    def __init__(self, way: socket.socket) -> None:
        """Take the flight's end of `datagram_pair`; not blocking."""
        self._way = way
        self._due_s = -float("inf")
        self._ticks: deque[tuple[Any, ...]] = deque(maxlen=_MOST_TICKS)
        self._newest: dict[str, tuple[Any, ...]] = {}
        self._kept: deque[tuple[Any, ...]] = deque(maxlen=_MOST_KEPT)
        self._packets: dict[bytes, tuple[float, bytes]] = {}
        self.gone = False
        """Nobody is at the other end any more."""

    def on_record(self, topic: str, time_s: float, values: Mapping[str, Any]) -> None:
        """Keep a record until the next handing over."""
        if topic == CONTROL.topic:
            self._ticks.append((RECORD, time_s, topic, values))
        elif topic in (EVENT.topic, INPUT.topic):
            self._kept.append((RECORD, time_s, topic, values))
        elif topic != CONFIGURATION.topic:  # that one the page has from the beginning
            self._newest[topic] = (RECORD, time_s, topic, values)
        if time_s >= self._due_s:
            self._hand_over(time_s)

    def on_frame_in(self, time_s: float, raw: bytes) -> None:
        """Keep the newest packet of each kind that is shown, until the next handing over."""
        if len(raw) > _HEADER_BYTES and raw[0] == _MAVLINK_2:
            key = raw[_SENDER_AT:_HEADER_BYTES]
            if key[2] | key[3] << 8 in _SHOWN and (
                key in self._packets or len(self._packets) < _MOST_SENDERS
            ):
                self._packets[key] = (time_s, raw)
        if time_s >= self._due_s:
            self._hand_over(time_s)

    def end(self, time_s: float, outcome: Mapping[str, Any]) -> None:
        """Tell how the flight ended, and close; the flight is over, so this may wait a second."""
        self._ticks.clear()
        self._packets.clear()
        self._newest.clear()
        self._kept.append((END, time_s, outcome))
        with contextlib.suppress(OSError):
            self._way.settimeout(_LAST_WORD_S)
        self._hand_over(time_s)
        self.close()

    def close(self) -> None:
        """Nothing more comes; safe to call twice."""
        self.gone = True
        with contextlib.suppress(OSError):
            self._way.close()

    def _hand_over(self, time_s: float) -> None:
        self._due_s = time_s + INTERVAL_S
        if self.gone:
            return
        packets = [
            (PACKET, at_s, base64.b64encode(raw).decode()) for at_s, raw in self._packets.values()
        ]
        all_of_it = [*self._kept, *packets, *self._newest.values(), *self._ticks]
        if not self._sent(all_of_it) and not self._sent(list(self._kept)):
            return  # what is kept is tried again
        self._kept.clear()
        self._packets.clear()
        self._newest.clear()
        self._ticks.clear()

    def _sent(self, items: list[tuple[Any, ...]]) -> bool:
        """Send items in one datagram; False if it was not taken, and may be another time."""
        try:
            self._way.send(orjson.dumps(items, default=str, option=orjson.OPT_SERIALIZE_NUMPY))
        except TypeError:
            pass  # of values that JSON has no word for: they are not shown
        except OSError as error:
            if error.errno in _ANOTHER_TIME or isinstance(error, TimeoutError):
                return False
            self.close()
        return True
