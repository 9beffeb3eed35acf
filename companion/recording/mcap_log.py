"""Controller records as MCAP (https://mcap.dev/spec), for Foxglove, PlotJuggler and replay.

Records are JSON with a JSON Schema for each channel.  A flush ends a chunk, so an unfinished
file holds whole chunks and can be read up to the last flush.  The channels are told again every
ten seconds, so that what comes behind damage can be read, too.
"""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mcap.records import Channel, Header, Metadata, Schema

from companion.recording.append_file import AppendFile
from companion.recording.json_record import record_json
from companion.recording.mcap_parts import MAGIC, ChunkMaker, record_bytes
from companion.recording.mcap_reader import BASE, CLOCK, LogRecord, read_records
from companion.recording.mcap_summary import ending
from companion.recording.schema import ChannelSpec, json_schema, spec_from_record

__all__ = ["LogRecord", "McapLog", "read_records"]

LIBRARY = "companion"
_LARGEST_CHUNK_BYTES = 256 * 1024
_TOLD_AGAIN_S = 10.0


class McapLog:
    """Writes records; they reach the system at `flush`."""

    __slots__ = (
        "_base_ns",
        "_channels",
        "_chunk",
        "_file",
        "_metadata",
        "_records_of_channels",
        "_records_of_schemas",
        "_tell_again_s",
    )

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
        self._metadata = {BASE: str(base_us)}
        self._chunk = ChunkMaker()
        self._channels: dict[str, int] = {}
        self._records_of_schemas: list[bytes] = []
        self._records_of_channels: list[bytes] = []
        self._tell_again_s = -math.inf
        self._file.write(MAGIC)
        self._file.write(record_bytes(Header(profile="", library=LIBRARY)))
        self._file.write(record_bytes(Metadata(name=CLOCK, metadata=self._metadata)))
        for spec in channels:
            self._add(spec)

    def write(self, topic: str, time_s: float, record: Mapping[str, Any]) -> None:
        """Add one record."""
        channel = self._channels.get(topic)
        if channel is None:
            channel = self._add(spec_from_record(topic, record))
        data = record_json(record)
        chunk = self._chunk
        if time_s >= self._tell_again_s:
            self._tell_again_s = time_s + _TOLD_AGAIN_S
            for schema in self._records_of_schemas:
                chunk.add(schema)
            for known_channel in self._records_of_channels:
                chunk.add(known_channel)
        chunk.add_message(channel, self._base_ns + round(time_s * 1e9), data)
        if chunk.size > _LARGEST_CHUNK_BYTES:
            self._file.write(chunk.finish())

    def flush(self) -> None:
        """End the chunk and hand everything to the system.

        Raises:
            OSError: it refuses (disk full); the file keeps the whole chunks from before.
        """
        if self._chunk.has_messages:
            self._file.write(self._chunk.finish())
        self._file.flush()

    def close(self) -> None:
        """Write the index and close; safe to call twice.

        Raises:
            OSError: the last records, or the index, cannot be written; the file is closed all
                the same, and what it holds can be read.
        """
        if self._file.closed:
            return
        try:
            self.flush()
            self._file.write(
                ending(
                    self._file.read_at,
                    self._file.tell(),
                    self._records_of_schemas,
                    self._records_of_channels,
                )
            )
        finally:
            self._file.close()

    def abandon(self) -> None:
        """Close without an index, after the system has refused to write."""
        self._file.abandon()

    def _add(self, spec: ChannelSpec) -> int:
        number = len(self._channels) + 1
        schema = Schema(
            id=number,
            name=spec.topic,
            encoding="jsonschema",
            data=json.dumps(json_schema(spec)).encode(),
        )
        channel = Channel(
            id=number,
            topic=spec.topic,
            message_encoding="json",
            metadata=self._metadata,
            schema_id=number,
        )
        self._records_of_schemas.append(record_bytes(schema))
        self._records_of_channels.append(record_bytes(channel))
        if self._tell_again_s > -math.inf:
            # Else all are told together before the first record.
            self._chunk.add(self._records_of_schemas[-1])
            self._chunk.add(self._records_of_channels[-1])
        self._channels[spec.topic] = number
        return number
