"""Telemetry logs as QGroundControl, MAVExplorer and mavlogdump read them.

Each record is eight bytes of big-endian microseconds and then one MAVLink packet.  As MAVProxy
does, the two lowest bits of the time say on which link the packet was: 0 received, 1 sent.
"""

import math
import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from companion.recording.append_file import AppendFile

TIME = struct.Struct(">Q")
"""Microseconds since 1970, before each packet."""
_HEAD_BYTES = 3
"""Of a packet, by which its length is known."""
_LONGEST_RECORD = TIME.size + 12 + 255 + 13
_BLOCK = 1 << 20
_LINK_BITS = 3
_SENT = 1


class TlogRecord(NamedTuple):
    """One packet of a log."""

    time_us: int
    """Without the link bits, so to 4 µs."""
    sent: bool
    """True if the companion sent it (in logs that the companion wrote)."""
    raw: bytes


class TlogWriter:
    """Appends packets to a log; they reach the system at `flush`."""

    __slots__ = ("_base_us", "_file", "_stamped_s", "_stamps")

    def __init__(self, path: Path, base_us: int = 0) -> None:
        """Create the file.

        Args:
            path: where; must not exist yet.
            base_us: microseconds since 1970 at the caller's time 0.

        Raises:
            OSError: the file cannot be made.
        """
        self._file = AppendFile(path)
        self._base_us = base_us
        self._stamped_s = math.nan
        self._stamps = (b"", b"")
        """Of that time, received and sent: of a tick's packets many come at one time."""

    def write(self, time_s: float, raw: bytes, *, sent: bool) -> None:
        """Add one packet."""
        if time_s != self._stamped_s:
            time_us = (self._base_us + round(time_s * 1e6)) & ~_LINK_BITS
            self._stamps = (TIME.pack(time_us), TIME.pack(time_us | _SENT))
            self._stamped_s = time_s
        self._file.write(self._stamps[sent] + raw)

    def flush(self) -> None:
        """Hand everything to the system.

        Raises:
            OSError: it refuses (disk full); the file keeps the whole packets from before.
        """
        self._file.flush()

    def close(self) -> None:
        """Flush and close; safe to call twice.

        Raises:
            OSError: the last packets cannot be written; the file is closed all the same.
        """
        self._file.close()

    def abandon(self) -> None:
        """Close without writing what is left, after the system has refused to write."""
        self._file.abandon()


def read_tlog(path: str | os.PathLike[str]) -> Iterator[TlogRecord]:
    """Records of a log, in order; a record cut off at the end, or zeros there, are left out.

    The file is read in pieces: a long one takes no more memory than a short one.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no tlog, or is damaged in the middle.
    """
    with Path(path).open("rb") as file:
        data = file.read(_BLOCK)
        before = position = 0
        while True:
            if len(data) - position < _LONGEST_RECORD and (block := file.read(_BLOCK)):
                before += position
                data = data[position:] + block
                position = 0
            if position + TIME.size + _HEAD_BYTES > len(data):
                return
            start = position + TIME.size
            length = packet_length(data, start)
            if length is None:
                if not data[position:].strip(b"\0") and _only_zeros(file):
                    return  # a power cut leaves zeros where the last write was under way
                raise ValueError(
                    f"{path}: no MAVLink packet at byte {before + start}; this is no whole tlog. "
                    f"`companion recover {path}` saves what is whole."
                )
            if start + length > len(data):
                return
            time_us: int = TIME.unpack_from(data, position)[0]
            yield TlogRecord(
                time_us & ~_LINK_BITS,
                time_us & _LINK_BITS == _SENT,
                data[start : start + length],
            )
            position = start + length


def _only_zeros(file: BinaryIO) -> bool:
    """True if nothing but zeros comes from here on."""
    while block := file.read(_BLOCK):
        if block.strip(b"\0"):
            return False
    return True


def packet_length(data: bytes, start: int) -> int | None:
    """Length of the packet that begins at `start`, by its header; None if there is none."""
    if data[start] == 0xFD:
        return 12 + data[start + 1] + (13 if data[start + 2] & 1 else 0)
    if data[start] == 0xFE:
        return 8 + data[start + 1]
    return None
