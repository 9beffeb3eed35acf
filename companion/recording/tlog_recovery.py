"""What is whole in a damaged or unfinished tlog, and a tlog of that alone."""

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from companion.recording.append_file import AppendFile
from companion.recording.loss import Loss, only_zeros
from companion.recording.tlog import TIME, packet_length

PacketCheck = Callable[[bytes], bool | None]
"""Says of a packet whether its check sum fits; None where that cannot be known."""

_LINK_BITS = 3
_SHORTEST_PACKET = 8
_LEAP_US = 1_000_000
"""So far a record's time does not lie outside its neighbours', unless it is damaged."""
_COPIED_AT_ONCE = 1 << 20


@dataclass(slots=True)
class TlogFindings:
    """What a tlog holds."""

    packets: int = 0
    first_us: int | None = None
    """Time of the first whole packet, microseconds since 1970."""
    last_us: int | None = None
    spans: list[tuple[int, int]] = field(default_factory=list)
    """First byte of each stretch of whole records, and the first byte behind it."""
    losses: list[Loss] = field(default_factory=list)

    @property
    def whole(self) -> bool:
        """True if there is nothing but whole packets."""
        return not self.losses


def examine_tlog(path: Path, check: PacketCheck) -> TlogFindings:
    """Look through a tlog.

    Args:
        path: of the file.
        check: decides about a packet by its check sum.

    Raises:
        OSError: it cannot be read.
    """
    data = path.read_bytes()
    found = TlogFindings()
    position = 0
    while position < len(data):
        end = _end_of_record(data, position, check)
        if end is None:
            resumed = _next_record(data, position + 1, check)
            found.losses.append(_loss(data, position, resumed, found.last_us))
            position = resumed
            continue
        time_us = _time_us(data, position)
        if _leaps(data, time_us, end, found.last_us, check):
            found.losses.append(_loss(data, position, end, found.last_us))
            position = end
            continue
        found.first_us = time_us if found.first_us is None else found.first_us
        found.last_us = time_us
        found.packets += 1
        if found.spans and found.spans[-1][1] == position:
            found.spans[-1] = (found.spans[-1][0], end)
        else:
            found.spans.append((position, end))
        position = end
    return found


def write_recovered_tlog(source: Path, found: TlogFindings, out: Path) -> None:
    """Write the whole records of a file to another one.

    Raises:
        OSError: one cannot be read, or the other exists or cannot be written.
    """
    target = AppendFile(out)
    try:
        with source.open("rb") as file:
            for start, end in found.spans:
                file.seek(start)
                while start < end:
                    data = file.read(min(_COPIED_AT_ONCE, end - start))
                    if not data:
                        raise OSError(f"{source} has become shorter while it was read")
                    target.write(data)
                    target.flush()
                    start += len(data)
        target.close()
    except BaseException:
        target.abandon()
        os.unlink(out)
        raise


def _end_of_record(data: bytes, position: int, check: PacketCheck) -> int | None:
    """Where the record that begins at a position ends; None if none that is whole does."""
    start = position + TIME.size
    if start + _SHORTEST_PACKET > len(data):
        return None
    length = packet_length(data, start)
    if length is None or start + length > len(data):
        return None
    end = start + length
    fits = check(data[start:end])
    if fits is None:
        # Nobody knows its check sum; then it is whole if another record follows it.
        fits = end == len(data) or _may_begin(data, end)
    return end if fits else None


def _time_us(data: bytes, position: int) -> int:
    time_us: int = TIME.unpack_from(data, position)[0]
    return time_us & ~_LINK_BITS


def _leaps(data: bytes, time_us: int, end: int, before_us: int | None, check: PacketCheck) -> bool:
    """Whether a record's time is damaged: far outside those around it, which are in order.

    No check sum covers it.  Where the clock itself was set, those around are not in order, or the
    times stay where they have leapt to.
    """
    if before_us is None or not _may_begin(data, end):
        return False
    after_us = _time_us(data, end)
    if before_us > after_us:
        return False
    if before_us - _LEAP_US <= time_us <= after_us + _LEAP_US:
        return False
    return _end_of_record(data, end, check) is not None


def _may_begin(data: bytes, position: int) -> bool:
    start = position + TIME.size
    return start + 2 < len(data) and packet_length(data, start) is not None


def _next_record(data: bytes, position: int, check: PacketCheck) -> int:
    """Where the next whole record begins, by a check sum that is known; else the end."""
    place = position + TIME.size
    while place < len(data):
        places = (data.find(0xFD, place), data.find(0xFE, place))
        place = min((found for found in places if found >= 0), default=len(data))
        if place + _SHORTEST_PACKET > len(data):
            break
        length = packet_length(data, place)
        if length is not None and check(data[place : place + length]):
            return place - TIME.size
        place += 1
    return len(data)


def _loss(data: bytes, start: int, end: int, after_us: int | None) -> Loss:
    before_us = None
    if end < len(data):
        before_us = _time_us(data, end)
    return Loss(start, end, after_us, before_us, only_zeros(data[start:end]))
