"""What is whole in a damaged or unfinished MCAP log, and an indexed log of that alone.

Chunks carry a check sum, so each that is found whole can be trusted.  Behind damage the next one is
found by what every chunk has in the same place.  Everything else in a log is told in several
places, or is made anew: the message indexes, the summary.
"""

import mmap
import os
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Header, Metadata

from companion.recording.append_file import AppendFile
from companion.recording.loss import Loss, only_zeros
from companion.recording.mcap_knowledge import Knowledge
from companion.recording.mcap_log import LIBRARY
from companion.recording.mcap_parts import (
    CHUNK_SIGNATURE,
    HEAD,
    MAGIC,
    DamagedPartError,
    decompressed,
    message_in,
    message_index,
    record_bytes,
    records_in,
    take_apart,
)
from companion.recording.mcap_reader import BASE, CLOCK
from companion.recording.mcap_summary import ending

_FOOTER_BYTES = HEAD.size + 20
_DATA_END_BYTES = HEAD.size + 4
_WRITTEN_AT_ONCE = 1 << 20

Bytes = bytes | mmap.mmap


class NotOursError(ValueError):
    """Another program's file; the text says so."""


@dataclass(slots=True)
class McapFindings:
    """What a log holds."""

    records: int = 0
    first_us: int | None = None
    """Time of the first whole record, microseconds since 1970."""
    last_us: int | None = None
    chunks: list[tuple[int, int]] = field(default_factory=list)
    """First byte of each whole chunk, and the first byte behind it."""
    losses: list[Loss] = field(default_factory=list)
    indexed: bool = False
    """It was finished, and its index is what its chunks say."""
    knowledge: Knowledge = field(default_factory=Knowledge)

    @property
    def whole(self) -> bool:
        """True if nothing is to be done."""
        return self.indexed and not self.losses


def examine_mcap(path: Path) -> McapFindings:
    """Look through a log.

    Raises:
        OSError: it cannot be read.
        NotOursError: another program's.
    """
    with path.open("rb") as file:
        if os.fstat(file.fileno()).st_size == 0:
            return McapFindings()
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return _examine(data)


def write_recovered_mcap(source: Path, found: McapFindings, out: Path) -> None:
    """Write the whole chunks of a log to another file, with an index.

    Raises:
        OSError: one cannot be read, or the other exists or cannot be written.
    """
    knowledge = found.knowledge
    target = AppendFile(out)
    try:
        clock = {BASE: str(knowledge.base_us or 0)}
        target.write(MAGIC)
        target.write(record_bytes(Header(profile="", library=LIBRARY)))
        target.write(record_bytes(Metadata(name=CLOCK, metadata=clock)))
        schemas = list(knowledge.schemas.values())
        channels = knowledge.all_channels()
        # Told before anything else: the chunk that told them may be among what is lost.
        for record in (*schemas, *channels):
            target.write(record)
        unflushed = 0
        with source.open("rb") as file:
            for start, end in found.chunks:
                file.seek(start)
                chunk = file.read(end - start)
                indexes = b"".join(_indexes(chunk))
                target.write(chunk)
                target.write(indexes)
                unflushed += len(chunk)
                if unflushed > _WRITTEN_AT_ONCE:
                    target.flush()
                    unflushed = 0
        target.flush()
        target.write(ending(target.read_at, target.tell(), schemas, channels))
        target.close()
    except BaseException:
        target.abandon()
        os.unlink(out)
        raise


def _examine(data: Bytes) -> McapFindings:
    found = McapFindings()
    end, summary = _end_of_data(data)
    indexes: list[bytes] = []
    """Of the last chunk, as far as they have not come yet."""
    indexes_fit = summary is not None
    position = len(MAGIC) if data[: len(MAGIC)] == MAGIC else 0
    while position < end:
        opcode, record_end = _record_at(data, position, end)
        if opcode == Opcode.DATA_END and record_end == position + _DATA_END_BYTES:
            break  # behind it lies the index, which is damaged
        if opcode == Opcode.CHUNK and _take_chunk(found, data, position, record_end):
            indexes_fit = indexes_fit and not indexes
            indexes = list(_indexes(data[position:record_end]))
        elif opcode == Opcode.MESSAGE_INDEX and data[position:record_end] in indexes:
            indexes.remove(data[position:record_end])
        elif opcode == Opcode.MESSAGE_INDEX and _may_begin(data, record_end, end):
            indexes_fit = False
        elif opcode in _TELLING and _may_begin(data, record_end, end):
            content = data[position + HEAD.size : record_end]
            if not found.knowledge.learn(opcode, content, checked=False):
                found.losses.append(_loss(data, position, record_end, end, found.last_us))
        else:
            record_end = _next_chunk(data, position + 1, end)
            found.losses.append(_loss(data, position, record_end, end, found.last_us))
        position = record_end
    if summary is not None:
        found.indexed = indexes_fit and not indexes and not found.losses
        for opcode, content in _summary_records(data, summary):
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                found.knowledge.learn(opcode, content, checked=True)
    library = found.knowledge.library
    if found.knowledge.base_us is None and library not in (None, LIBRARY):
        raise NotOursError(f"it was written by '{library[:60]}', not by the companion")
    return found


_TELLING = (Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA)


def _end_of_data(data: Bytes) -> tuple[int, int | None]:
    """Where the records end, and where the summary begins; None if there is none that is whole."""
    size = len(data)
    footer = size - len(MAGIC) - _FOOTER_BYTES
    if footer < len(MAGIC) or data[size - len(MAGIC) :] != MAGIC:
        return size, None
    if HEAD.unpack_from(data, footer) != (Opcode.FOOTER, 20):
        return size, None
    content = data[footer + HEAD.size : footer + _FOOTER_BYTES]
    start = int.from_bytes(content[:8], "little")
    crc = int.from_bytes(content[16:], "little")
    if not len(MAGIC) + _DATA_END_BYTES <= start <= footer:
        return size, None
    if zlib.crc32(data[start : footer + _FOOTER_BYTES - 4]) != crc:
        return size, None
    end = start - _DATA_END_BYTES
    return (end, start) if data[end] == Opcode.DATA_END else (size, None)


def _summary_records(data: Bytes, start: int) -> Iterator[tuple[int, bytes]]:
    """Of a summary that is whole."""
    while True:
        opcode, length = HEAD.unpack_from(data, start)
        if opcode == Opcode.FOOTER:
            return
        yield opcode, data[start + HEAD.size : start + HEAD.size + length]
        start += HEAD.size + length


def _record_at(data: Bytes, position: int, end: int) -> tuple[int, int]:
    """Opcode of the record at a position, and where it ends; opcode 0 if none fits there."""
    if position + HEAD.size > end:
        return 0, end
    opcode, length = HEAD.unpack_from(data, position)
    record_end = position + HEAD.size + length
    return (opcode, record_end) if record_end <= end else (0, end)


def _may_begin(data: Bytes, position: int, end: int) -> bool:
    """True if a record can begin there, or the data end there."""
    return position == end or 1 <= _record_at(data, position, end)[0] <= max(Opcode)


def _take_chunk(found: McapFindings, data: Bytes, start: int, end: int) -> bool:
    """Note a chunk; False if it is damaged."""
    content = data[start + HEAD.size : end]
    try:
        chunk = take_apart(content)
        parts = list(records_in(decompressed(chunk)))
        messages = [message_in(at, part) for code, at, part in parts if code == Opcode.MESSAGE]
    except DamagedPartError:
        return False
    for opcode, _, part in parts:
        if opcode in _TELLING:
            found.knowledge.learn(opcode, part, checked=True)
    found.knowledge.used.update(dict.fromkeys(message.channel for message in messages))
    found.records += len(messages)
    found.chunks.append((start, end))
    if messages:
        times_us = [message.time_ns // 1000 for message in messages]
        found.first_us = times_us[0] if found.first_us is None else found.first_us
        found.last_us = max(times_us)
    return True


def _indexes(chunk: bytes) -> Iterator[bytes]:
    """The message indexes of a whole chunk, one for each channel."""
    entries: dict[int, list[tuple[int, int]]] = {}
    for opcode, offset, part in records_in(decompressed(take_apart(chunk[HEAD.size :]))):
        if opcode == Opcode.MESSAGE:
            message = message_in(offset, part)
            entries.setdefault(message.channel, []).append((message.time_ns, offset))
    for channel, places in entries.items():
        yield message_index(channel, places)


def _next_chunk(data: Bytes, position: int, end: int) -> int:
    """Where the next whole chunk begins; the end if there is none."""
    offset, signature = CHUNK_SIGNATURE
    place = data.find(signature, position + offset, end)
    while place >= 0:
        start = place - offset
        opcode, record_end = _record_at(data, start, end)
        if opcode == Opcode.CHUNK and _take_chunk(McapFindings(), data, start, record_end):
            return start
        place = data.find(signature, place + 1, end)
    return end


def _loss(data: Bytes, start: int, resumed: int, end: int, after_us: int | None) -> Loss:
    before_us = None
    if resumed < end:
        before_us = HEAD.size + resumed
        before_us = int.from_bytes(data[before_us : before_us + 8], "little") // 1000
    return Loss(start, resumed, after_us, before_us, only_zeros(data[start:resumed]))
