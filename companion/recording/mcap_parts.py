"""The parts of an MCAP file (https://mcap.dev/spec) that are written and read while flying.

The library's writer keeps an object for each chunk until the end, which at five chunks a second
is 15 MiB an hour, and its reader trusts every length that it reads.  So chunks are made and taken
apart here; the records that are seldom written are the library's.
"""

import struct
import zlib
from collections.abc import Iterator
from itertools import chain
from typing import NamedTuple

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import McapRecord

MAGIC = bytes((137, 77, 67, 65, 80, 48, 13, 10))
"""At the beginning of each file, and at the end of a finished one."""
HEAD = struct.Struct("<BQ")
"""Of each record: its opcode, the length of what follows."""
MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Of a message: channel, sequence, time of logging and of publishing in ns."""
CHUNK_HEAD = struct.Struct("<QQQI")
"""Of a chunk: first and last time in ns, size when decompressed, CRC-32 of that."""
LARGEST_CHUNK = 64 << 20
"""Bytes, decompressed, that are read; ours have 256 KiB at most, others a few MiB."""

_MESSAGE = struct.Struct("<BQHIQQ")
"""Both together, as a message begins."""

_ZSTD = b"\x04\0\0\0zstd"
CHUNK_SIGNATURE = (HEAD.size + CHUNK_HEAD.size, _ZSTD)
"""By which a chunk of ours is found again behind damage: an offset, and the bytes there."""
_MESSAGE_OPCODE = int(Opcode.MESSAGE)
_LENGTH = struct.Struct("<Q")
_TEXT = struct.Struct("<I")
_INDEX_HEAD = struct.Struct("<HI")
_INDEX_ENTRY = struct.Struct("<QQ")


class DamagedPartError(McapError):
    """A part is not what was written."""


class Chunk(NamedTuple):
    """A chunk, taken apart but not decompressed."""

    start_ns: int
    end_ns: int
    size: int
    """Decompressed, bytes."""
    crc: int
    compression: str
    data: bytes


class PlainMessage(NamedTuple):
    """One message of a chunk, as it lies in it."""

    offset: int
    """From the beginning of the chunk's decompressed records."""
    channel: int
    time_ns: int
    data: bytes


def record_bytes(record: McapRecord) -> bytes:
    """One of the library's records as it is written."""
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data


class ChunkMaker:
    """Collects records for one chunk after another."""

    __slots__ = ("_compress", "_end_ns", "_index", "_plain", "_start_ns")

    def __init__(self) -> None:
        self._compress = zstandard.ZstdCompressor(level=1).compress
        self._clear()

    def _clear(self) -> None:
        self._plain = bytearray()
        self._index: dict[int, list[tuple[int, int]]] = {}
        self._start_ns = self._end_ns = 0

    @property
    def size(self) -> int:
        """Of what has been collected, bytes."""
        return len(self._plain)

    @property
    def has_messages(self) -> bool:
        """True if there is anything that is worth a chunk."""
        return bool(self._index)

    def add(self, record: bytes) -> None:
        """Add a schema or a channel."""
        self._plain += record

    def add_message(self, channel: int, time_ns: int, data: bytes) -> None:
        """Add a message."""
        if not self._index:
            self._start_ns = self._end_ns = time_ns
        elif time_ns > self._end_ns:
            self._end_ns = time_ns
        elif time_ns < self._start_ns:
            self._start_ns = time_ns
        plain = self._plain
        self._index.setdefault(channel, []).append((time_ns, len(plain)))
        length = MESSAGE_HEAD.size + len(data)
        plain += _MESSAGE.pack(_MESSAGE_OPCODE, length, channel, 0, time_ns, time_ns)
        # Copied at once: what the encoder gives holds more memory than it has bytes.
        plain += data

    def finish(self) -> bytes:
        """Give the chunk with its message indexes, and begin the next one."""
        try:
            plain = self._plain
            chunk = chunk_record(self._start_ns, self._end_ns, plain, self._compress(plain))
            return chunk + b"".join(
                message_index(channel, entries) for channel, entries in self._index.items()
            )
        finally:
            self._clear()


def chunk_record(start_ns: int, end_ns: int, plain: bytes | bytearray, compressed: bytes) -> bytes:
    """A chunk as it is written."""
    content = b"".join(
        (
            CHUNK_HEAD.pack(start_ns, end_ns, len(plain), zlib.crc32(plain)),
            _ZSTD,
            _LENGTH.pack(len(compressed)),
            compressed,
        )
    )
    return HEAD.pack(Opcode.CHUNK, len(content)) + content


def message_index(channel: int, entries: list[tuple[int, int]]) -> bytes:
    """The index of one channel's messages in a chunk: their times in ns and their offsets."""
    content = _INDEX_HEAD.pack(channel, len(entries) * _INDEX_ENTRY.size)
    content += struct.pack(f"<{2 * len(entries)}Q", *chain.from_iterable(entries))
    return HEAD.pack(Opcode.MESSAGE_INDEX, len(content)) + content


def take_apart(content: bytes) -> Chunk:
    """Read a chunk record's content.

    Raises:
        DamagedPartError: its lengths do not fit.
    """
    try:
        start_ns, end_ns, size, crc = CHUNK_HEAD.unpack_from(content)
        position = CHUNK_HEAD.size
        (length,) = _TEXT.unpack_from(content, position)
        position += _TEXT.size
        compression = content[position : position + length].decode()
        position += length
        (length,) = _LENGTH.unpack_from(content, position)
    except (struct.error, UnicodeDecodeError) as error:
        raise DamagedPartError(f"its head cannot be read ({error})") from error
    data = content[position + _LENGTH.size :]
    if len(data) != length:
        raise DamagedPartError(f"it should hold {length} bytes and holds {len(data)}")
    return Chunk(start_ns, end_ns, size, crc, compression, data)


def decompressed(chunk: Chunk) -> bytes:
    """The records of a chunk, checked by its CRC.

    Raises:
        DamagedPartError: they are not what was written, or are more than is read.
    """
    if chunk.size > LARGEST_CHUNK:
        raise DamagedPartError(f"it says that it holds {chunk.size} bytes")
    if chunk.compression == "zstd":
        plain = _unpacked(chunk)
    elif chunk.compression == "":
        plain = chunk.data
    else:
        raise DamagedPartError(f"the compression {chunk.compression[:16]!r} is none of ours")
    if len(plain) != chunk.size:
        raise DamagedPartError(f"it should hold {chunk.size} bytes and holds {len(plain)}")
    if chunk.crc not in (0, zlib.crc32(plain)):
        raise DamagedPartError("its check sum does not fit")
    return plain


def _unpacked(chunk: Chunk) -> bytes:
    """Decompress, never into more than the chunk says: a frame may claim terabytes."""
    try:
        claimed = zstandard.frame_content_size(chunk.data)
        if claimed > chunk.size:
            raise DamagedPartError(f"it should hold {chunk.size} bytes and claims {claimed}")
        plain: bytes = zstandard.ZstdDecompressor().decompress(chunk.data, chunk.size)
        return plain
    except (zstandard.ZstdError, MemoryError) as error:
        raise DamagedPartError(f"it cannot be decompressed ({error})") from error


def records_in(plain: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Opcode, offset and content of each record of a chunk.

    Raises:
        DamagedPartError: their lengths do not fit.
    """
    position = 0
    while position < len(plain):
        if position + HEAD.size > len(plain):
            raise DamagedPartError("its last record is cut off")
        opcode, length = HEAD.unpack_from(plain, position)
        start = position + HEAD.size
        if start + length > len(plain):
            raise DamagedPartError("a record in it is longer than it")
        yield opcode, position, plain[start : start + length]
        position = start + length


def message_in(offset: int, content: bytes) -> PlainMessage:
    """Read a message record's content.

    Raises:
        DamagedPartError: it is too short.
    """
    if len(content) < MESSAGE_HEAD.size:
        raise DamagedPartError("a message in it is too short")
    channel, _, time_ns, _ = MESSAGE_HEAD.unpack_from(content)
    return PlainMessage(offset, channel, time_ns, content[MESSAGE_HEAD.size :])
