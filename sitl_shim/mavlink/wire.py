"""The one place that touches pymavlink: packing and parsing MAVLink 2, without I/O.

The dialect is ``all``: ``common`` lacks CURRENT_MODE and AVAILABLE_MODES.
"""

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

from pymavlink.dialects.v20 import all as dialect

from sitl_shim.mavlink.event_messages import REQUEST_ID, RequestEvent
from sitl_shim.mavlink.packets import Packet, frame_of, signed_frame_of

__all__ = ["Message", "Packer", "Parser", "dialect"]

Message = Any
"""A MAVLink message of the generated dialect, which is untyped; or a `Packet`, to be sent."""

_BAD_DATA = "BAD_DATA"
_UNKNOWN_PREFIX = "UNKNOWN"
_MOST_KEPT_BYTES = 4096
_REQUEST_EVENT = f"{_UNKNOWN_PREFIX}_{REQUEST_ID}"


class Packer:
    """Packs messages of one system and component, numbering them.

    Args:
        system_id: of the sender.
        component_id: of the sender.
    """

    __slots__ = ("_component_id", "_mavlink", "_system_id", "_take_stamp")

    def __init__(self, system_id: int, component_id: int) -> None:
        self._system_id, self._component_id = system_id, component_id
        self._mavlink = dialect.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
        self._take_stamp: Callable[[], int] | None = None

    def sign(self, key: bytes | None, link_id: int, take_stamp: Callable[[], int]) -> None:
        """Sign from now on, with 32 bytes of key; or, with None, no more.

        Args:
            key: of the vehicle.
            link_id: 0..255, stands in the signatures.
            take_stamp: gives each packet's time stamp.
        """
        signing = self._mavlink.signing
        signing.secret_key, signing.link_id = key, link_id
        signing.sign_outgoing = key is not None
        self._take_stamp = None if key is None else take_stamp

    def pack(self, message: Message) -> bytes:
        """One message as one MAVLink 2 frame."""
        mavlink = self._mavlink
        sequence: int = mavlink.seq
        take_stamp = self._take_stamp
        frame: bytes
        if type(message) is Packet and take_stamp is None:
            frame = frame_of(message, sequence, self._system_id, self._component_id)
        elif take_stamp is None:
            frame = message.pack(mavlink)
        elif type(message) is not Packet:
            mavlink.signing.timestamp = take_stamp()
            frame = message.pack(mavlink)
        else:
            signing = mavlink.signing
            signature = (signing.secret_key, signing.link_id, take_stamp())
            frame = signed_frame_of(
                message, sequence, self._system_id, self._component_id, signature
            )
        mavlink.seq = (sequence + 1) & 0xFF
        return frame


class Parser:
    """Finds messages in bytes; noise between them is skipped, never raised."""

    __slots__ = ("_mavlink",)

    def __init__(self) -> None:
        self._mavlink = dialect.MAVLink(None)
        self._mavlink.robust_parsing = True

    @property
    def between_messages(self) -> bool:
        """Whether nothing waits for its rest."""
        return bool(len(self._mavlink.buf) == self._mavlink.buf_index)

    def parse(self, data: bytes) -> Iterator[Message]:
        """Messages that are complete with ``data``, unknown ones and noise left out."""
        messages = self._mavlink.parse_buffer(data)
        self._forget_what_was_read()
        for message in messages or ():
            name = message.get_type()
            if name != _BAD_DATA and not name.startswith(_UNKNOWN_PREFIX):
                yield message
            elif name == _REQUEST_EVENT:  # pymavlink does not know it, and checks nothing
                with contextlib.suppress(ValueError):
                    yield RequestEvent(message)

    def _forget_what_was_read(self) -> None:
        """Without this pymavlink keeps every byte while chunks end in the middle of a message."""
        mavlink = self._mavlink
        if mavlink.buf_index > _MOST_KEPT_BYTES:
            del mavlink.buf[: mavlink.buf_index]
            mavlink.buf_index = 0
