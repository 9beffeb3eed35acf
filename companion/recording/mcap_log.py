"""Controller records as MCAP (https://mcap.dev/spec), for Foxglove, PlotJuggler and replay.

Records are JSON with a JSON Schema for each channel.  A flush ends a chunk, so an unfinished
file holds whole chunks and can be read up to the last flush.
"""

import io
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

from mcap.exceptions import EndOfFile
from mcap.records import Channel, Message, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from companion.recording.append_file import AppendFile
from companion.recording.json_record import RecordEncoder
from companion.recording.schema import ChannelSpec, json_schema, spec_from_record

_LIBRARY = "companion"
_CLOCK = "clock"
_BASE = "base_us"
_MAGIC_BYTES = 8
_RECORD_HEADER_BYTES = 9
_LARGEST_CHUNK = 256 * 1024


class LogRecord(NamedTuple):
    """One record of a log."""

    topic: str
    time_s: float
    """The writer's time (loop time of the flight)."""
    values: dict[str, Any]


class McapLog:
    """Writes records; they reach the system at `flush`."""

    __slots__ = ("_base_ns", "_channels", "_file", "_writer")

    def __init__(self, path: Path, channels: Sequence[ChannelSpec] = (), base_us: int = 0) -> None:
        """Create the file.

        Args:
            path: where; must not exist yet.
            channels: channels that are known from the start; others are made at their first
                record, as that one looks.
            base_us: microseconds since 1970 at the caller's time 0.

        Raises:
            OSError: the file cannot be made.
        """
        self._file = AppendFile(path)
        self._base_ns = base_us * 1000
        # The writer asks its stream for write, tell and flush, no more.
        self._writer = Writer(
            cast("io.BufferedWriter", self._file),
            chunk_size=_LARGEST_CHUNK,
            compression=CompressionType.ZSTD,
        )
        self._channels: dict[str, tuple[int, RecordEncoder]] = {}
        self._writer.start(library=_LIBRARY)
        self._writer.add_metadata(_CLOCK, {_BASE: str(base_us)})
        for spec in channels:
            self._add(spec)

    def write(self, topic: str, time_s: float, record: Mapping[str, Any]) -> None:
        """Add one record.

        Raises:
            OSError: a chunk is full and the system refuses it.
        """
        known = self._channels.get(topic)
        if known is None:
            known = self._add(spec_from_record(topic, record))
        channel, encoder = known
        time_ns = self._base_ns + round(time_s * 1e9)
        self._writer.add_message(channel, time_ns, encoder.encode(record), time_ns)

    def flush(self) -> None:
        """End the chunk and hand everything to the system.

        Raises:
            OSError: it refuses (disk full); the file keeps the whole chunks from before.
        """
        self._writer.flush()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Write the index and close; safe to call twice.

        Raises:
            OSError: the last records cannot be written; the file is closed all the same.
        """
        if self._file.closed:
            return
        try:
            self._writer.finish()  # type: ignore[no-untyped-call]
        finally:
            self._file.close()

    def abandon(self) -> None:
        """Close without an index, after the system has refused to write."""
        self._file.abandon()

    def _add(self, spec: ChannelSpec) -> tuple[int, RecordEncoder]:
        schema = self._writer.register_schema(
            spec.topic, "jsonschema", json.dumps(json_schema(spec)).encode()
        )
        channel = self._writer.register_channel(spec.topic, "json", schema)
        self._channels[spec.topic] = (channel, RecordEncoder(spec))
        return self._channels[spec.topic]


def read_records(path: str | os.PathLike[str]) -> Iterator[LogRecord]:
    """Records of a log in the order of writing, up to where an unfinished file ends.

    Raises:
        OSError: the file cannot be read.
        mcap.exceptions.McapError: it is no MCAP file.
    """
    data = Path(path).read_bytes()
    topics: dict[int, str] = {}
    base_ns = 0
    reader = StreamReader(io.BytesIO(data[: _end_of_whole_records(data)]))
    try:
        for record in reader.records:
            if isinstance(record, Message):
                time_s = (record.log_time - base_ns) / 1e9
                yield LogRecord(topics[record.channel_id], time_s, json.loads(record.data))
            elif isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Metadata) and record.name == _CLOCK:
                base_ns = int(record.metadata[_BASE]) * 1000
    except EndOfFile:
        return  # the writer was stopped before it could finish


def _end_of_whole_records(data: bytes) -> int:
    """Where the last record that is whole ends."""
    end = _MAGIC_BYTES
    while end + _RECORD_HEADER_BYTES <= len(data):
        length = int.from_bytes(data[end + 1 : end + _RECORD_HEADER_BYTES], "little")
        if end + _RECORD_HEADER_BYTES + length > len(data):
            # The magic bytes at the end of a finished file are no record.
            return len(data) if data[end:] == data[:_MAGIC_BYTES] else end
        end += _RECORD_HEADER_BYTES + length
    return len(data) if data[end:] == data[:_MAGIC_BYTES] else end
