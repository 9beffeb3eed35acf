"""The MAVLink messages of a flight as tables: one for each message.

Payloads are not decoded one by one: those of a message are laid one behind the other and read as
columns, by the layout that the dialect gives (https://mavlink.io/en/guide/serialization.html).
"""

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.export.source import Tell
from companion.export.tables import BATCH, LOG_TIME, Begin, Column, Table, TableWriter
from companion.mavlink.dialect import MESSAGE_CLASSES, message_name
from companion.recording.flight_files import FlightFiles

FOLDER = "mavlink"
_TOLD_EACH = 20_000
_MOST_SPREAD = 24
"""An array with more items becomes a text: nobody wants ninety columns of a log's data."""

_KINDS = {"i": "integer", "u": "unsigned", "f": "number"}
_SINGLE_BYTES = 4
_HEAD = (
    LOG_TIME,
    Column("sent", "boolean", about="true: by the companion; false: it was received"),
    Column("system", "integer", about="MAVLink system that sent it"),
    Column("component", "integer", about="its component; 240 is the simulation's truth"),
    Column(
        "autopilot_time_s", "number", "s", "", "by the message's time_boot_ms or time_usec, if any"
    ),
)


class Packet(NamedTuple):
    """A MAVLink packet taken apart; the payload is without its trailing zeros."""

    message_id: int
    system: int
    component: int
    payload: bytes


def taken_apart(raw: bytes) -> Packet:
    """A whole packet, MAVLink 2 or 1, as a log holds it."""
    if raw[0] == 0xFD:
        return Packet(int.from_bytes(raw[7:10], "little"), raw[5], raw[6], raw[10 : 10 + raw[1]])
    return Packet(raw[5], raw[3], raw[4], raw[6 : 6 + raw[1]])


@cache
def layout(message_id: int) -> np.dtype[np.void] | None:
    """How a message's payload lies in bytes; None if the dialect does not know the message."""
    message = MESSAGE_CLASSES.get(message_id)
    if message is None:
        return None
    types = dict(zip(message.fieldnames, message.fieldtypes, strict=True))
    fields: list[Any] = []
    for name, count in zip(message.ordered_fieldnames, message.array_lengths, strict=True):
        kind = types[name]
        if kind == "char":
            fields.append((name, f"S{max(count, 1)}"))
        elif count:
            fields.append((name, _NUMPY[kind], (count,)))
        else:
            fields.append((name, _NUMPY[kind]))
    return np.dtype(fields)


_NUMPY = {
    "int8_t": "<i1", "uint8_t": "<u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4",
    "uint32_t": "<u4", "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8",
    "uint8_t_mavlink_version": "<u1",
}  # fmt: skip


def read_messages(message_id: int, payloads: Sequence[bytes]) -> NDArray[Any]:
    """Messages of one kind as a structured array.

    Raises:
        KeyError: the dialect does not know the message.
    """
    dtype = layout(message_id)
    if dtype is None:
        raise KeyError(message_name(message_id))
    size = dtype.itemsize
    joined = b"".join(payload[:size].ljust(size, b"\0") for payload in payloads)
    return np.frombuffer(joined, dtype)


def write_packet_tables(
    files: FlightFiles, begin: Begin, tell: Tell
) -> tuple[list[tuple[Table, int]], dict[int, int]]:
    """Write the messages of the tlog.

    Returns:
        The tables with their numbers of rows; and what was left out, since the dialect does not
        know the message: how many packets by its number.

    Raises:
        FlightFilesError: the log cannot be read.
        OSError: a table cannot be written.
    """
    waiting: dict[int, _Messages] = {}
    unknown: dict[int, int] = {}
    count = 0
    try:
        for count, record in enumerate(files.packets(), 1):
            packet = taken_apart(record.raw)
            messages = waiting.get(packet.message_id)
            if messages is None:
                if layout(packet.message_id) is None:
                    number = packet.message_id
                    unknown[number] = unknown.get(number, 0) + 1
                    continue
                messages = waiting[packet.message_id] = _Messages(packet.message_id, begin)
            messages.add(files.log_time_s(record), record.sent, packet)
            if count % _TOLD_EACH == 0:
                tell("packets", count, None)
    finally:
        for messages in waiting.values():
            messages.close()
    tell("packets", count, count)
    return [(messages.table, messages.count) for messages in waiting.values()], unknown


class _Messages:
    """Messages of one kind on their way to their table."""

    __slots__ = ("_heads", "_message_id", "_payloads", "_spread", "_writer", "count", "table")

    def __init__(self, message_id: int, begin: Begin) -> None:
        self.count = 0
        self._message_id = message_id
        self._heads: list[tuple[float, bool, int, int]] = []
        self._payloads: list[bytes] = []
        self._spread = _spread(message_id)
        columns = tuple(column for column, _ in self._spread)
        self.table = Table(f"{FOLDER}/{message_name(message_id)}", _HEAD + columns)
        self._writer: TableWriter = begin(self.table)

    def add(self, log_time_s: float, sent: bool, packet: Packet) -> None:
        self._heads.append((log_time_s, sent, packet.system, packet.component))
        self._payloads.append(packet.payload)
        if len(self._heads) >= BATCH:
            self._flush()

    def close(self) -> None:
        try:
            self._flush()
        finally:
            self._writer.close()

    def _flush(self) -> None:
        if not self._heads:
            return
        fields = read_messages(self._message_id, self._payloads)
        heads: list[Sequence[Any]] = [list(column) for column in zip(*self._heads, strict=True)]
        self._writer.write(
            [*heads, autopilot_times_s(fields), *(_values(fields, at) for _, at in self._spread)]
        )
        self.count += len(self._heads)
        self._heads.clear()
        self._payloads.clear()


def autopilot_times_s(fields: NDArray[Any]) -> list[float | None]:
    """Times of messages by the sender's clock, where they tell one; 0 is none."""
    names = fields.dtype.names or ()
    for name, unit_s in (("time_boot_ms", 1e-3), ("time_usec", 1e-6)):
        if name in names:
            return [int(value) * unit_s if value else None for value in fields[name]]
    return [None] * len(fields)


_At = tuple[str, int | None]
"""A field, and the item of it; None: all of it."""


def _spread(message_id: int) -> list[tuple[Column, _At]]:
    """The columns of a message's fields."""
    message = MESSAGE_CLASSES[message_id]
    dtype = layout(message_id)
    assert dtype is not None
    units = message.fieldunits_by_name
    found: list[tuple[Column, _At]] = []
    for name in message.fieldnames:
        kind = dtype[name]
        base, shape = kind.subdtype if kind.subdtype is not None else (kind, ())
        unit = units.get(name, "")
        if base.kind == "S":
            found.append((Column(name, "string"), (name, None)))
        elif not shape:
            found.append((Column(name, _kind(base), unit), (name, None)))
        elif shape[0] > _MOST_SPREAD:
            about = f"{shape[0]} numbers, a space between two"
            found.append((Column(name, "string", unit, "", about), (name, None)))
        else:
            found += [
                (Column(f"{name}_{k}", _kind(base), unit), (name, k)) for k in range(shape[0])
            ]
    return found


def _kind(base: np.dtype[Any]) -> str:
    if base.kind == "f" and base.itemsize == _SINGLE_BYTES:
        return "single"
    if base.kind == "u" and base.itemsize <= _SINGLE_BYTES:
        return "integer"
    return _KINDS[base.kind]


def _values(fields: NDArray[Any], at: _At) -> Sequence[Any]:
    name, item = at
    column = fields[name]
    if item is not None:
        column = column[:, item]
    elif column.dtype.kind == "S":
        return [text.split(b"\0")[0].decode("utf-8", "replace") for text in column.tolist()]
    elif column.ndim > 1:
        return [" ".join(str(number) for number in row) for row in column.tolist()]
    if column.dtype.kind == "f":
        finite = np.isfinite(column)
        if not finite.all():
            return [
                value if ok else None for value, ok in zip(column.tolist(), finite, strict=True)
            ]
    values: list[Any] = column.tolist()
    return values
