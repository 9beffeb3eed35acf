"""Reading a flight's records back, from files that were not finished, too."""

import io
import json
import os
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, InvalidMagic
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata

from companion.recording.mcap_parts import (
    HEAD,
    LARGEST_CHUNK,
    MAGIC,
    DamagedPartError,
    decompressed,
    message_in,
    records_in,
    take_apart,
)

CLOCK = "clock"
"""Name of the metadata with the flight's clock; each channel carries the same."""
BASE = "base_us"
"""In it: microseconds since 1970 at the writer's time 0."""
_BLOCK = 1 << 16
_LATEST_US = 1 << 60


class LogRecord(NamedTuple):
    """One record of a log."""

    topic: str
    time_s: float
    """The writer's time (loop time of the flight)."""
    values: dict[str, Any]


class DamagedLogError(DamagedPartError):
    """A log is damaged; the text says where, and the remedy."""


class _Contents:
    """What is known of the channels and the clock, and so what a message says."""

    def __init__(self) -> None:
        self._topics: dict[int, str] = {}
        self._base_ns = 0

    def take(self, opcode: int, content: bytes) -> None:
        """Learn from a channel or from metadata.

        Raises:
            DamagedPartError: it is damaged.
        """
        try:
            stream = ReadDataStream(io.BytesIO(content))
            if opcode == Opcode.CHANNEL:
                channel = Channel.read(stream)
                self._topics[channel.id] = channel.topic
                self._set_base(channel.metadata)
            elif opcode == Opcode.METADATA:
                metadata = Metadata.read(stream)
                if metadata.name == CLOCK:
                    self._set_base(metadata.metadata)
        except (EndOfFile, ValueError, struct.error, MemoryError) as error:
            raise DamagedPartError(f"it cannot be read ({error})") from error

    def record(self, offset: int, content: bytes) -> LogRecord:
        """Read a message.

        Raises:
            DamagedPartError: it is damaged, or none of ours.
        """
        message = message_in(offset, content)
        topic = self._topics.get(message.channel)
        if topic is None:
            raise DamagedPartError(f"nothing says what channel {message.channel} is")
        try:
            values = json.loads(message.data)
        except (ValueError, RecursionError, MemoryError) as error:
            raise DamagedPartError(f"a record of '{topic}' is no JSON ({error})") from error
        if not isinstance(values, dict):
            raise DamagedPartError(f"a record of '{topic}' is no JSON object")
        return LogRecord(topic, (message.time_ns - self._base_ns) / 1e9, values)

    def _set_base(self, metadata: dict[str, str]) -> None:
        base_us = told_base_us(metadata)
        if base_us is not None:
            self._base_ns = base_us * 1000


def told_base_us(metadata: Mapping[str, str]) -> int | None:
    """Microseconds since 1970 at the writer's time 0, if metadata tell them.

    Raises:
        ValueError: they tell something else.
    """
    if BASE not in metadata:
        return None
    base_us = int(metadata[BASE])
    if not 0 <= base_us < _LATEST_US:
        raise ValueError(f"no clock shows {base_us} µs")
    return base_us


def read_records(path: str | os.PathLike[str]) -> Iterator[LogRecord]:
    """Records of a log in the order of writing, up to where an unfinished file ends.

    One that was killed ends anywhere, a power cut may have left zeros at its end: neither is an
    error.  The memory that it takes does not depend on what a file says of itself.

    Raises:
        OSError: the file cannot be read.
        mcap.exceptions.McapError: it is no MCAP file, or none of ours, or is damaged before its
            end (`DamagedLogError`, which names the remedy).
    """
    contents = _Contents()
    for opcode, position, content in _parts(Path(path)):
        try:
            if opcode == Opcode.CHUNK:
                plain = decompressed(take_apart(content))
                for inner, offset, part in records_in(plain):
                    if inner == Opcode.MESSAGE:
                        yield contents.record(offset, part)
                    else:
                        contents.take(inner, part)
            elif opcode == Opcode.MESSAGE:
                yield contents.record(0, content)
            else:
                contents.take(opcode, content)
        except DamagedLogError:
            raise
        except DamagedPartError as error:
            raise DamagedLogError(_damage(path, position, str(error))) from error


def _parts(path: Path) -> Iterator[tuple[int, int, bytes]]:
    """Opcode, position and content of each record that says something, up to the data's end."""
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        magic = file.read(len(MAGIC))
        if magic != MAGIC[: len(magic)]:
            raise InvalidMagic(magic)
        position = len(magic)
        finished = _ends_with_magic(file, size)
        while position + HEAD.size <= size:
            file.seek(position)
            head = file.read(HEAD.size)
            if len(head) < HEAD.size:
                return  # it was cut while it was read
            opcode, length = HEAD.unpack(head)
            end = position + HEAD.size + length
            if opcode == Opcode.FOOTER and finished:
                return
            if opcode == 0 or end > size:
                if opcode == 0 and not _zeros_to_the_end(file, position):
                    raise DamagedLogError(_damage(path, position, "no record begins there"))
                if finished:
                    raise DamagedLogError(_damage(path, position, "it is longer than the file"))
                return  # the writer was stopped before it could finish
            if opcode in (Opcode.CHUNK, Opcode.MESSAGE, Opcode.CHANNEL, Opcode.METADATA):
                if length > LARGEST_CHUNK:
                    raise DamagedLogError(_damage(path, position, f"it has {length} bytes"))
                yield opcode, position, file.read(length)
            position = end


def _ends_with_magic(file: io.BufferedReader, size: int) -> bool:
    """True for a file that was finished."""
    if size < 2 * len(MAGIC):
        return False
    file.seek(size - len(MAGIC))
    return file.read(len(MAGIC)) == MAGIC


def _zeros_to_the_end(file: io.BufferedReader, position: int) -> bool:
    file.seek(position)
    while block := file.read(_BLOCK):
        if any(block):
            return False
    return True


def _damage(path: str | os.PathLike[str], position: int, why: str) -> str:
    return (
        f"{path} is damaged: the record at byte {position} is not what was written: {why}. "
        f"`companion recover {path}` saves the rest."
    )
