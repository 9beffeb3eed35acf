"""An input of the MAVLink targets: a header, and records of bytes that come one after another.

Each record is a byte that says what it is (its meaning is the target's), a byte for a time that
passes before it, the length of its data in two bytes, and the data.  Any bytes can be read so.
"""

import struct
from collections.abc import Iterable
from typing import NamedTuple

HEADER = 4
_HEAD = struct.Struct("<BBH")
_LONGEST = 4096


class Record(NamedTuple):
    """One thing that happens."""

    kind: int
    wait: int
    """In ticks of the target, before it."""
    data: bytes


def join(header: bytes, records: Iterable[Record]) -> bytes:
    """The input of a header and records."""
    parts = [header.ljust(HEADER, b"\0")[:HEADER]]
    for record in records:
        data = record.data[:_LONGEST]
        parts.append(_HEAD.pack(record.kind & 0xFF, record.wait & 0xFF, len(data)) + data)
    return b"".join(parts)


def split(data: bytes) -> tuple[bytes, list[Record]]:
    """Header and records of an input; what is cut off at its end is a shorter record."""
    header = data[:HEADER].ljust(HEADER, b"\0")
    records = []
    position = HEADER
    while position + _HEAD.size <= len(data):
        kind, wait, length = _HEAD.unpack_from(data, position)
        position += _HEAD.size
        length = min(length, _LONGEST)
        records.append(Record(kind, wait, data[position : position + length]))
        position += length
    return header, records
