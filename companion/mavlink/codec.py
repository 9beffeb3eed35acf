"""From frames to message objects, and from payloads to packets."""

import struct
from functools import cache
from itertools import accumulate
from typing import Any

from companion.mavlink.crc import CRC_INDEX, CRC_TABLE, crc16
from companion.mavlink.dialect import CRC_EXTRA, MESSAGE_CLASSES, MAVLink, Message, message_class
from companion.mavlink.framing import Frame
from companion.mavlink.messages import COMPONENT_ONBOARD_COMPUTER, Outgoing
from companion.mavlink.signing import Signer

_HEADER = struct.Struct("<BBBBBBHB")
"""Header of MAVLink 2 behind the magic byte."""
_SIGNED = 0x01
"""Incompatibility flag of a packet with a signature."""


class UnknownMessageError(Exception):
    """The dialect has no such message, so its payload cannot be read."""


def decode(frame: Frame) -> Message:
    """Read a frame (whose CRC the framer has checked) into pymavlink's message object.

    Three times faster than pymavlink's own decoder, which would check the CRC once more.

    Raises:
        UnknownMessageError: the dialect does not know the id (see `Frame.decodable`).
    """
    message_id = frame.message_id
    generated = MESSAGE_CLASSES.get(message_id)
    if generated is None:
        raise UnknownMessageError(f"the MAVLink dialect has no message {message_id}")
    size = generated.unpacker.size
    values = generated.unpacker.unpack(frame.payload.ljust(size, b"\0")[:size])
    message = generated(*[values[place] for place in _field_places(message_id)])
    header = message.get_header()
    header.srcSystem = frame.system_id
    header.srcComponent = frame.component_id
    header.seq = frame.sequence
    return message


@cache
def _field_places(message_id: int) -> tuple[int | slice, ...]:
    """Where each field of a message, in the constructor's order, lies in the unpacked tuple.

    `lengths` counts values, so it is 1 for a text, which `struct` unpacks as one value.
    """
    generated = MESSAGE_CLASSES[message_id]
    lengths = generated.lengths
    starts = [0, *accumulate(lengths)]
    return tuple(
        starts[order] if lengths[order] == 1 else slice(starts[order], starts[order + 1])
        for order in generated.orders
    )


def encode(name: str, /, **fields: Any) -> Outgoing:  # noqa: ANN401 - fields differ by message
    """Make any message of the dialect from its fields (texts as bytes, arrays as sequences).

    For messages that are sent often or early there are functions in `messages`, `commands` and
    `setpoints` that need no pymavlink object.

    Raises:
        KeyError: the dialect has no such message.
        TypeError: a field is missing or is not one of the message.
        struct.error: a value does not fit its field.
    """
    generated = message_class(name)
    message = generated(**fields)
    message.pack(MAVLink(None))
    # Of the class: STATUSTEXT has a field of the name `id`, which hides it in the object.
    return Outgoing(int(generated.id), bytes(message.get_payload()))


class Packer:
    """Puts header and CRC around payloads, as one system and component, and counts them."""

    __slots__ = ("_signer", "component_id", "sequence", "system_id")

    def __init__(
        self,
        system_id: int,
        component_id: int = COMPONENT_ONBOARD_COMPUTER,
        signer: Signer | None = None,
    ) -> None:
        """Pack as `component_id` of `system_id` (a companion has the vehicle's system id).

        Args:
            system_id: 1..255.
            component_id: 1..255.
            signer: signs every packet; None leaves them unsigned.

        Raises:
            ValueError: there are no such ids.
        """
        if not 1 <= system_id <= 255 or not 1 <= component_id <= 255:
            raise ValueError(f"MAVLink ids are 1..255, not {system_id}/{component_id}")
        self.system_id = system_id
        self.component_id = component_id
        self.sequence = 0
        self._signer = signer

    def pack(self, outgoing: Outgoing) -> bytes:
        """Make the MAVLink 2 packet, trailing zeros of the payload cut off.

        Raises:
            KeyError: nobody knows the message's CRC_EXTRA.
        """
        message_id, payload = outgoing
        payload = payload.rstrip(b"\0") or b"\0"
        covered = (
            _HEADER.pack(
                len(payload),
                0 if self._signer is None else _SIGNED,
                0,
                self.sequence,
                self.system_id,
                self.component_id,
                message_id & 0xFFFF,
                message_id >> 16,
            )
            + payload
        )
        self.sequence = (self.sequence + 1) & 0xFF
        crc = crc16(covered)
        crc = CRC_TABLE[(crc ^ CRC_EXTRA[message_id]) & 0xFF] ^ (crc >> 8)
        packet = b"\xfd" + covered + crc.to_bytes(2, "little")
        return packet if self._signer is None else self._signer.sign(packet)


def signed_anew(frame: Frame, signer: Signer) -> bytes | None:
    """A packet of somebody else, under our signature: for what is forwarded to a link with a key.

    Returns:
        The packet with sender, sequence and payload as they were; None for one of MAVLink 1,
        which can't be signed.
    """
    if frame.version != 2:
        return None
    raw = frame.raw
    end = 10 + raw[1]
    # The CRC covers the flag that announces the signature.  What closes it (CRC_EXTRA) is solved
    # from the old one, so that messages which the dialect does not know can be signed, too.
    crc = crc16(raw[1:end])
    extra = CRC_INDEX[(raw[end] | raw[end + 1] << 8) ^ (crc >> 8)] ^ (crc & 0xFF)
    covered = raw[1:2] + bytes([raw[2] | _SIGNED]) + raw[3:end]
    crc = crc16(covered)
    crc = CRC_TABLE[(crc ^ extra) & 0xFF] ^ (crc >> 8)
    return signer.sign(b"\xfd" + covered + crc.to_bytes(2, "little"))
