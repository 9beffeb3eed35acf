"""Valid packets of every message, and variations of them that get past the checksum."""

import gzip
import hashlib
import random
import struct
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import NamedTuple

from companion.mavlink.crc import CRC_TABLE, crc16
from companion.mavlink.dialect import CRC_EXTRA, CRC_EXTRA_UNDECODABLE, MESSAGE_CLASSES
from companion.mavlink.framing import Frame, Framer
from companion.recording.tlog import TIME, packet_length

_FLOATS = (
    *(0.0, -0.0, 1.0, -1.0, 0.5, 1e-30, -1e-45, 9.81, 100.0, 1e5, -1e5, 3e9, 1e30, 3.4e38, -3.4e38),
    *(float("nan"), float("inf"), float("-inf")),
)
_SIZES = {"b": 1, "B": 1, "c": 1, "h": 2, "H": 2, "i": 4, "I": 4, "q": 8, "Q": 8, "f": 4, "d": 8}
_KEPT_PER_ID = 24
_SETUP_SIGNING = 256
_EXTRA = CRC_EXTRA | CRC_EXTRA_UNDECODABLE


class Place(NamedTuple):
    """Where a field of a payload lies."""

    name: str
    offset: int
    code: str
    """Of `struct`, for one element."""
    count: int


@cache
def layout(message_id: int) -> tuple[Place, ...]:
    """The fields of a message, in the order of the wire; empty for one that is not known."""
    kind = MESSAGE_CLASSES.get(message_id)
    if kind is None:
        return ()
    places, offset = [], 0
    codes = [code for code in kind.native_format.decode() if code not in "<>"]
    lengths = kind.array_lengths
    for name, code, length in zip(kind.ordered_fieldnames, codes, lengths, strict=True):
        count = max(1, length)
        places.append(Place(name, offset, code, count))
        offset += _SIZES[code] * count
    return tuple(places)


def size_of(message_id: int) -> int:
    """Bytes of a message's whole payload."""
    return sum(_SIZES[place.code] * place.count for place in layout(message_id))


@dataclass(slots=True)
class Sender:
    """Who packs: its ids, its numbering, its key."""

    system_id: int = 1
    component_id: int = 1
    key: bytes | None = None
    stamp: int = 1 << 44
    """Of 10 µs since 2015: later than the clocks of both targets."""
    sequence: int = field(default=0)

    def pack(self, message_id: int, payload: bytes, *, version: int = 2) -> bytes:
        """A packet with a checksum that is right."""
        self.sequence = (self.sequence + 1) & 0xFF
        payload = payload[:255]
        ids = bytes((self.sequence, self.system_id & 0xFF, self.component_id & 0xFF))
        if version == 1:
            body = bytes((len(payload),)) + ids + bytes((message_id & 0xFF,)) + payload
            return b"\xfe" + body + _crc(body, message_id)
        payload = payload.rstrip(b"\0") or b"\0"
        flags = b"\x00" if self.key is None else b"\x01"
        number = (message_id & 0xFFFFFF).to_bytes(3, "little")
        body = bytes((len(payload),)) + flags + b"\x00" + ids + number + payload
        packet = b"\xfd" + body + _crc(body, message_id)
        if self.key is None:
            return packet
        self.stamp += 1
        packet += b"\x07" + self.stamp.to_bytes(6, "little")
        return packet + hashlib.sha256(self.key + packet).digest()[:6]


def _crc(body: bytes, message_id: int) -> bytes:
    crc = crc16(body)
    extra = _EXTRA.get(message_id, 77)
    crc = CRC_TABLE[(crc ^ extra) & 0xFF] ^ (crc >> 8)
    return crc.to_bytes(2, "little")


def captured(folder: Path) -> dict[int, list[bytes]]:
    """Payloads of real autopilots' and clients' packets, by message id."""
    found: dict[int, list[bytes]] = {}
    for path in sorted(folder.glob("*.tlog.gz")):
        for frame in _frames(gzip.decompress(path.read_bytes())):
            kept = found.setdefault(frame.message_id, [])
            if len(kept) < _KEPT_PER_ID:
                kept.append(frame.payload)
    return found


def _frames(tlog: bytes) -> list[Frame]:
    framer = Framer()
    frames: list[Frame] = []
    position = 0
    while position + TIME.size + 3 <= len(tlog):
        start = position + TIME.size
        length = packet_length(tlog, start)
        if length is None:
            break
        frames += framer.feed(tlog[start : start + length])
        position = start + length
    return frames


class PacketSource:
    """Makes packets: whole ones, and others."""

    def __init__(
        self,
        read_ids: tuple[int, ...],
        likely: dict[str, tuple[float, ...]],
        captures: dict[int, list[bytes]],
    ) -> None:
        """Prepare.

        Args:
            read_ids: of the messages that the target reads: most packets are of these.
            likely: values of fields, by name, with which a message is taken seriously.
            captures: payloads to begin with.
        """
        self._read = read_ids
        self._all = tuple(sorted(MESSAGE_CLASSES))
        self._likely = likely
        self._captures = captures

    def payload(self, rng: random.Random) -> tuple[int, bytes]:
        """A message id and a payload: from a capture, of random bytes, or of likely values."""
        message_id = rng.choice(self._read if rng.random() < 0.8 else self._all)
        if message_id == _SETUP_SIGNING and rng.random() < 0.97:
            message_id = 0  # a key that nobody knows ends the conversation
        kept = self._captures.get(message_id)
        if kept is not None and rng.random() < 0.5:
            payload = bytearray(rng.choice(kept).ljust(size_of(message_id), b"\0"))
        else:
            size = size_of(message_id)
            payload = bytearray(size if rng.random() < 0.3 else rng.randbytes(size))
        places = layout(message_id)
        for place in places:
            values = self._likely.get(place.name)
            if values is not None and rng.random() < 0.8:
                _put(payload, place, rng.choice(values), rng)
        for _ in range(rng.choice((0, 0, 1, 1, 2, 5))):
            if places:
                self._change_field(payload, rng.choice(places), rng)
        if rng.random() < 0.1 and payload:
            payload[rng.randrange(len(payload))] = rng.randrange(256)
        if rng.random() < 0.06:
            payload = payload[: rng.randrange(len(payload) + 1)]
        elif rng.random() < 0.02:
            payload += rng.randbytes(rng.randrange(1, 60))
        return message_id, bytes(payload)

    def packet(self, rng: random.Random, sender: Sender, others: Sender) -> bytes:
        """A packet; nearly always with a checksum that is right."""
        message_id, payload = self.payload(rng)
        who = sender
        if rng.random() < 0.12:
            who = others
            others.system_id, others.component_id = rng.choice(
                ((1, 1), (1, 240), (1, 191), (2, 1), (255, 190), (0, 0), (1, rng.randrange(256)))
            )
        if message_id == 0 and rng.random() < 0.9 and len(payload) >= 9:
            payload = payload[:5] + bytes((rng.choice((3, 12, 12, 8)),)) + payload[6:]
        version = 1 if message_id < 256 and rng.random() < 0.07 else 2
        packet = who.pack(message_id, payload, version=version)
        chance = rng.random()
        if chance < 0.9:
            return packet
        return _broken(packet, rng)

    def _change_field(self, payload: bytearray, place: Place, rng: random.Random) -> None:
        if place.code in "fd":
            _put(payload, place, rng.choice(_FLOATS), rng)
            return
        bits = 8 * _SIZES[place.code]
        values = (0, 1, -1, 1 << (bits - 1), (1 << (bits - 1)) - 1, rng.getrandbits(bits))
        _put(payload, place, rng.choice(values), rng)


def _broken(packet: bytes, rng: random.Random) -> bytes:
    """A packet that is not whole, or not alone."""
    at = rng.randrange(len(packet))
    match rng.randrange(7):
        case 0:
            return packet[:at]
        case 1:
            return packet[at:]
        case 2:
            return packet[:at] + bytes((packet[at] ^ 1 << rng.randrange(8),)) + packet[at + 1 :]
        case 3:
            return packet[:at] + rng.randbytes(rng.randrange(20)) + packet[at:]
        case 4:
            return packet + packet
        case 5:
            return bytes(rng.choice((0xFD, 0xFE, 0, 255)) for _ in range(rng.randrange(1, 60)))
        case _:
            return packet[: max(1, at)] + packet


def _put(payload: bytearray, place: Place, value: float, rng: random.Random) -> None:
    size = _SIZES[place.code]
    offset = place.offset + size * rng.randrange(place.count)
    if offset + size > len(payload):
        return
    if place.code in "fd":
        struct.pack_into(f"<{place.code}", payload, offset, value)
        return
    number = int(value) if value == value and abs(value) < 1e30 else 0
    payload[offset : offset + size] = (number & (1 << 8 * size) - 1).to_bytes(size, "little")
