"""The end of an MCAP file: the index and the statistics, made from the file itself.

Nothing of it is kept in memory while the file grows.
"""

import struct
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from mcap.opcode import Opcode
from mcap.records import (
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    MetadataIndex,
    Statistics,
    SummaryOffset,
)

from companion.recording.mcap_parts import CHUNK_HEAD, HEAD, MAGIC, record_bytes

ReadAt = Callable[[int, int], bytes]
"""Takes a position and a size, and gives at most as many bytes of the file."""

_LOOK = 64
"""Bytes of each record that are looked at: the head of a chunk up to its data."""
_NUMBERS = struct.Struct("<HI")
_INDEX_ENTRY_BYTES = 16
_TEXT_BYTES = 4


@dataclass(slots=True)
class _Found:
    """What the data section holds."""

    chunks: list[ChunkIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    messages: dict[int, int] = field(default_factory=dict)
    """How many there are of each channel."""


def ending(read_at: ReadAt, end: int, schemas: Sequence[bytes], channels: Sequence[bytes]) -> bytes:
    """What finishes a file.

    Args:
        read_at: reads the file, which is one of ours: chunks with zstd, each followed by its
            message indexes, metadata between them.
        end: where the last of them ends.
        schemas: each schema's record, as it lies in the file.
        channels: each channel's, too.

    Raises:
        OSError: the file cannot be read.
    """
    found = _look_through(read_at, end)
    data_end = record_bytes(DataEnd(0))
    start = end + len(data_end)
    groups: list[tuple[Opcode, list[bytes]]] = [
        (Opcode.SCHEMA, list(schemas)),
        (Opcode.CHANNEL, list(channels)),
        (Opcode.STATISTICS, [record_bytes(_statistics(found, len(schemas), len(channels)))]),
        (Opcode.CHUNK_INDEX, _all_bytes(found.chunks)),
        (Opcode.METADATA_INDEX, _all_bytes(found.metadata)),
    ]
    summary, offsets = b"", b""
    for opcode, records in groups:
        group = b"".join(records)
        if group:
            offset = SummaryOffset(
                group_opcode=opcode, group_start=start + len(summary), group_length=len(group)
            )
            offsets += record_bytes(offset)
        summary += group
    offsets_start = start + len(summary)
    # The footer's CRC covers the summary and the footer up to the CRC itself.
    footer = record_bytes(Footer(start, offsets_start, 0))[:-4]
    crc = zlib.crc32(summary + offsets + footer)
    return data_end + summary + offsets + footer + crc.to_bytes(4, "little") + MAGIC


def _look_through(read_at: ReadAt, end: int) -> _Found:
    found = _Found()
    for opcode, position, length, content in _records(read_at, end):
        whole = HEAD.size + length
        if opcode == Opcode.CHUNK:
            found.chunks.append(_chunk_index(position, whole, content))
        elif opcode == Opcode.MESSAGE_INDEX:
            channel, size = _NUMBERS.unpack_from(content)
            count = found.messages.get(channel, 0) + size // _INDEX_ENTRY_BYTES
            found.messages[channel] = count
            chunk = found.chunks[-1]
            chunk.message_index_offsets[channel] = position
            chunk.message_index_length += whole
        elif opcode == Opcode.METADATA:
            size = int.from_bytes(content[:_TEXT_BYTES], "little")
            name = content[_TEXT_BYTES : _TEXT_BYTES + size].decode(errors="replace")
            found.metadata.append(MetadataIndex(position, whole, name))
    return found


def _records(read_at: ReadAt, end: int) -> Iterator[tuple[int, int, int, bytes]]:
    """Opcode, position, length, and the beginning of the content of each record."""
    position = len(MAGIC)
    while position < end:
        look = read_at(position, _LOOK)
        opcode, length = HEAD.unpack_from(look)
        yield opcode, position, length, look[HEAD.size :]
        position += HEAD.size + length


def _chunk_index(position: int, whole: int, content: bytes) -> ChunkIndex:
    start_ns, end_ns, size, _ = CHUNK_HEAD.unpack_from(content)
    at = CHUNK_HEAD.size
    named = int.from_bytes(content[at : at + _TEXT_BYTES], "little")
    at += _TEXT_BYTES
    compression = content[at : at + named].decode()
    at += named
    return ChunkIndex(
        chunk_length=whole,
        chunk_start_offset=position,
        compression=compression,
        compressed_size=int.from_bytes(content[at : at + 8], "little"),
        message_end_time=end_ns,
        message_index_length=0,
        message_index_offsets={},
        message_start_time=start_ns,
        uncompressed_size=size,
    )


def _statistics(found: _Found, schemas: int, channels: int) -> Statistics:
    return Statistics(
        attachment_count=0,
        channel_count=channels,
        channel_message_counts=found.messages,
        chunk_count=len(found.chunks),
        message_count=sum(found.messages.values()),
        message_end_time=max((chunk.message_end_time for chunk in found.chunks), default=0),
        message_start_time=min((chunk.message_start_time for chunk in found.chunks), default=0),
        metadata_count=len(found.metadata),
        schema_count=schemas,
    )


def _all_bytes(records: Sequence[McapRecord]) -> list[bytes]:
    return [record_bytes(record) for record in records]
