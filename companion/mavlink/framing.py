"""Splits a byte stream into MAVLink frames, whatever else the stream carries.

Packet layout: https://mavlink.io/en/guide/serialization.html.  The CRC decides whether bytes are
a frame.  It is closed by a seed, CRC_EXTRA, that is known for each message of the dialect.  For
other ids the seed is solved from their first packet, which is skipped, and has to fit from the
second one on.  Bytes that are no frame are skipped one at a time, so that a false start in noise
does not swallow a true frame behind it.
"""

import struct
from typing import NamedTuple

from companion.mavlink.crc import CRC_INDEX, CRC_TABLE, crc16
from companion.mavlink.dialect import CRC_EXTRA, CRC_EXTRA_UNDECODABLE

MAGIC_V1 = 0xFE
MAGIC_V2 = 0xFD
LARGEST_FRAME = 280
"""Bytes: header 10, payload 255, CRC 2, signature 13."""

_HEADER_V2 = struct.Struct("<xBBxBBBHB")
"""Length, incompatibility flags, sequence, system, component, message id (low, high)."""
_HEADER_V2_BYTES = 10
_INCOMPATIBLE_SIGNED = 0x01
_MOST_UNKNOWN_IDS = 64

_ALL_CRC_EXTRA = CRC_EXTRA | CRC_EXTRA_UNDECODABLE


class Frame(NamedTuple):
    """One packet as it was on the wire: a tuple, since that is immutable and cheap to make."""

    raw: bytes
    """The whole packet, from the magic byte to the CRC or the signature."""
    version: int
    """1 or 2."""
    message_id: int
    system_id: int
    component_id: int
    sequence: int
    signed: bool
    """True if a signature is attached; it is checked by `signing.Verifier`."""

    @property
    def payload(self) -> bytes:
        """Payload bytes, without the zeros that MAVLink 2 cuts off at the end."""
        raw = self.raw
        start = 10 if self.version == 2 else 6
        return raw[start : start + raw[1]]

    @property
    def decodable(self) -> bool:
        """True if the dialect knows the message, so that `codec.decode` can read it."""
        return self.message_id in CRC_EXTRA


class Framer:
    """Cuts frames out of one byte stream.  Keeps at most one unfinished frame in memory."""

    __slots__ = ("_learned", "_pending", "looks")

    def __init__(self) -> None:
        self.looks = 0
        """Places at which a packet seemed to begin, so far: what the work goes by."""
        self._pending = b""
        self._learned: dict[int, int] = {}

    @property
    def pending_bytes(self) -> int:
        """Bytes held back because a frame may continue in the next ones."""
        return len(self._pending)

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes of the stream and give the frames that they complete."""
        if not self._pending:
            only = _only_frame(data)
            if only is not None:
                self.looks += 1
                return [only]
        frames, self._pending = self._split(self._pending + data if self._pending else data)
        return frames

    def finish(self) -> list[Frame]:
        """Say that the stream has ended; give the frames behind an unfinished one, if any."""
        frames: list[Frame] = []
        while self._pending:
            more, self._pending = self._split(self._pending[1:])
            frames += more
        return frames

    def _split(self, data: bytes) -> tuple[list[Frame], bytes]:
        """Frames in `data`, and the bytes at its end that may be the start of one more."""
        frames: list[Frame] = []
        position, end, looks = 0, len(data), 0
        while position < end:
            magic = data[position]
            if magic != MAGIC_V2 and magic != MAGIC_V1:
                position = _next_magic(data, position + 1)
                continue
            looks += 1
            header = 10 if magic == MAGIC_V2 else 6
            if end - position < header:
                if magic == MAGIC_V2 and end - position > 2 and data[position + 2] > 1:
                    position += 1
                    continue
                break
            signed = False
            length = header + data[position + 1] + 2
            if magic == MAGIC_V2:
                flags = data[position + 2]
                if flags:
                    if flags != _INCOMPATIBLE_SIGNED:
                        position += 1
                        continue
                    signed = True
                    length += 13
                (sequence, system_id, component_id) = data[position + 4 : position + 7]
                message_id = int.from_bytes(data[position + 7 : position + 10], "little")
            else:
                (sequence, system_id, component_id, message_id) = data[position + 2 : position + 6]
            if end - position < length:
                break
            # A datagram with one frame is the common case: no copy then.
            raw = data if length == end else data[position : position + length]
            if not self._crc_fits(raw, header, message_id):
                position += 1
                continue
            version = 2 if magic == MAGIC_V2 else 1
            frames.append(
                Frame(raw, version, message_id, system_id, component_id, sequence, signed)
            )
            position += length
        self.looks += looks
        return frames, data[position:]

    def _crc_fits(self, raw: bytes, header: int, message_id: int) -> bool:
        """Check the CRC of a whole frame."""
        end = header + raw[1]
        crc = crc16(raw[1:end])
        found = raw[end] | raw[end + 1] << 8
        extra = _ALL_CRC_EXTRA.get(message_id)
        if extra is not None:
            return found == CRC_TABLE[(crc ^ extra) & 0xFF] ^ (crc >> 8)
        # Only 256 of the 65,536 values of `found` can come from any seed.
        index = CRC_INDEX.get(found ^ (crc >> 8))
        return index is not None and self._confirms(message_id, (index ^ crc) & 0xFF)

    def _confirms(self, message_id: int, extra: int) -> bool:
        """True if the last packet of an unknown id had the same seed; else remember this one."""
        learned = self._learned
        if learned.pop(message_id, None) == extra:
            learned[message_id] = extra
            return True
        if len(learned) >= _MOST_UNKNOWN_IDS:
            del learned[next(iter(learned))]  # the one not seen for longest
        learned[message_id] = extra
        return False


def _only_frame(data: bytes) -> Frame | None:
    """The one frame that a datagram is, as nearly all are; None where `Framer` has to look closer.

    It does so unless the data is exactly one packet of MAVLink 2, not signed, of a known message.
    """
    length = len(data)
    if length < _HEADER_V2_BYTES + 2 or data[0] != MAGIC_V2:
        return None
    size, flags, sequence, system_id, component_id, low, high = _HEADER_V2.unpack_from(data)
    end = _HEADER_V2_BYTES + size
    if flags or length != end + 2:
        return None
    message_id = low | high << 16
    extra = _ALL_CRC_EXTRA.get(message_id)
    if extra is None:
        return None
    crc = crc16(data[1:end])
    if data[end] | data[end + 1] << 8 != CRC_TABLE[(crc ^ extra) & 0xFF] ^ (crc >> 8):
        return None
    # Past the constructor, which takes twice as long.
    fields = (data, 2, message_id, system_id, component_id, sequence, False)
    return tuple.__new__(Frame, fields)


def _next_magic(data: bytes, start: int) -> int:
    """Index of the next byte that may start a frame, or the length of `data`."""
    places = (data.find(MAGIC_V2, start), data.find(MAGIC_V1, start))
    return min((place for place in places if place >= 0), default=len(data))
