"""Messages as bytes at once: precompiled layouts for what is streamed often.

pymavlink makes an object per message, and packs it field by field; at some 600 messages per
simulated second that is most of what a simulated vehicle costs.  A `Packet` is a message whose
payload is packed already, by the layout and with the checksum seed of pymavlink's own definition.
https://mavlink.io/en/guide/serialization.html
"""

import hashlib
from struct import Struct
from typing import Any, Final

from fastcrc.crc16 import mcrf4xx

Untyped = Any
"""What pymavlink hands out."""
_MAGIC: Final = b"\xfd"
_SIGNED: Final = 0x01
_HEADER: Final = Struct("<BBBBBB3s")
"""What follows the magic byte, and is summed up with the payload."""
_STAMP: Final = Struct("<BQ")
_STAMP_BYTES: Final = 7
_SIGNATURE_BYTES: Final = 6


class Layout:
    """How one message stands in a payload.

    Args:
        message: pymavlink's class of it.
        grouped: the same layout for `struct`, where constants that stand together are given as one
            piece of bytes; None takes the class's own.

    Raises:
        ValueError: ``grouped`` does not have the message's length.
    """

    __slots__ = ("message_id", "name", "pack", "seed", "wire_id")

    def __init__(self, message: Untyped, grouped: str | None = None) -> None:
        own: Struct = message.unpacker
        content = own if grouped is None else Struct(grouped)
        if content.size != own.size:
            raise ValueError(f"{message.msgname} has {own.size} bytes, not {content.size}")
        self.message_id: int = message.id
        self.wire_id = self.message_id.to_bytes(3, "little")
        self.name: str = message.msgname
        self.seed = bytes([message.crc_extra])
        """Stands at the end of what is summed up, and not on the wire."""
        self.pack = content.pack
        """The payload of its fields, which stand in the order of the wire: larger types first."""


class Packet:
    """One message that is packed but for what its sender adds.

    Args:
        layout: of the message.
        payload: by the layout.
    """

    __slots__ = ("layout", "payload")

    def __init__(self, layout: Layout, payload: bytes) -> None:
        self.layout = layout
        self.payload = payload


def frame_of(
    packet: Packet, sequence: int, system_id: int, component_id: int, flags: int = 0
) -> bytes:
    """A packet as a MAVLink 2 frame, but for its signature if it has one.

    Args:
        packet: what is sent.
        sequence: of the sender, 0..255.
        system_id: of the sender.
        component_id: of the sender.
        flags: 1 if a signature follows.
    """
    layout = packet.layout
    # Zeros at the end are left out, but for the first byte.
    payload = packet.payload.rstrip(b"\0") or b"\0"
    header = _HEADER.pack(len(payload), flags, 0, sequence, system_id, component_id, layout.wire_id)
    body = header + payload
    checksum: int = mcrf4xx(body + layout.seed)
    return _MAGIC + body + checksum.to_bytes(2, "little")


def signed_frame_of(
    packet: Packet,
    sequence: int,
    system_id: int,
    component_id: int,
    signature: tuple[bytes, int, int],
) -> bytes:
    """A packet as a signed frame (https://mavlink.io/en/guide/message_signing.html).

    Args:
        packet: what is sent.
        sequence: of the sender, 0..255.
        system_id: of the sender.
        component_id: of the sender.
        signature: key, link id, and time stamp.
    """
    key, link_id, stamp = signature
    frame = frame_of(packet, sequence, system_id, component_id, _SIGNED)
    frame += _STAMP.pack(link_id, stamp)[:_STAMP_BYTES]
    return frame + hashlib.sha256(key + frame).digest()[:_SIGNATURE_BYTES]
