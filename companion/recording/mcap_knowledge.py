"""What the records of a log tell of its channels and its clock, wherever in it they stand."""

import io
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field

from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Metadata, Schema

from companion.recording.mcap_parts import record_bytes
from companion.recording.mcap_reader import CLOCK, told_base_us


@dataclass(slots=True)
class Knowledge:
    """Each schema and channel as its record, by its number; what is told twice counts once."""

    schemas: dict[int, bytes] = field(default_factory=dict)
    channels: dict[int, bytes] = field(default_factory=dict)
    used: dict[int, None] = field(default_factory=dict)
    """Channels with messages, in the order in which they came."""
    base_us: int | None = None
    """Microseconds since 1970 at the writer's time 0; None if nothing tells it."""
    library: str | None = None
    """Who wrote the file, by its header."""

    def learn(self, opcode: int, content: bytes, *, checked: bool) -> bool:
        """Take what a record tells.

        Args:
            opcode: of the record.
            content: of the record.
            checked: it stands under a check sum, so it is worth more than what does not.

        Returns:
            False if it is damaged; it tells nothing then.
        """
        stream = ReadDataStream(io.BytesIO(content))
        try:
            if opcode == Opcode.HEADER:
                self.library = Header.read(stream).library
            elif opcode == Opcode.SCHEMA:
                schema = Schema.read(stream)
                if checked or schema.id not in self.schemas:
                    self.schemas[schema.id] = record_bytes(schema)
            elif opcode == Opcode.CHANNEL:
                channel = Channel.read(stream)
                if checked or channel.id not in self.channels:
                    self.channels[channel.id] = record_bytes(channel)
                self._set_base(channel.metadata, checked=checked)
            elif opcode == Opcode.METADATA:
                metadata = Metadata.read(stream)
                if metadata.name == CLOCK:
                    self._set_base(metadata.metadata, checked=checked)
        except (EndOfFile, ValueError, struct.error, MemoryError):
            return False
        return True

    def all_channels(self) -> list[bytes]:
        """The record of each channel, and one for each that nothing is known of but its number."""
        unknown = [
            Channel(
                id=number, topic=f"unknown-{number}", message_encoding="json", metadata={},
                schema_id=0,
            )
            for number in self.used
            if number not in self.channels
        ]  # fmt: skip
        return [*self.channels.values(), *(record_bytes(channel) for channel in unknown)]

    def _set_base(self, metadata: Mapping[str, str], *, checked: bool) -> None:
        base_us = told_base_us(metadata)
        if base_us is not None and (checked or self.base_us is None):
            self.base_us = base_us
