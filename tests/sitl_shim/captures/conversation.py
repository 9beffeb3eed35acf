"""What a vehicle said, recorded from a real one or by the replay to the shim."""

import gzip
import json
import struct
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from companion.mavlink.codec import decode
from companion.mavlink.framing import Frame, Framer

CAPTURES = Path(__file__).resolve().parents[2] / "data" / "captures"
VEHICLE = (1, 1)


@dataclass(frozen=True)
class Said:
    """One frame, at the vehicle's boot time."""

    time_s: float
    frame: Frame

    @property
    def message(self) -> Any:
        return decode(self.frame)


@dataclass
class Conversation:
    """One side's frames in order, and how many of each id came in each window."""

    begins_s: float
    ends_s: float
    said: list[Said]
    window_s: float
    counts: dict[int, dict[int, int]]
    """By message id, then by window (its number from boot on)."""
    _by_id: dict[int, list[Said]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for said in self.said:
            self._by_id.setdefault(said.frame.message_id, []).append(said)

    def frames(self, *message_ids: int) -> list[Said]:
        found = [said for number in message_ids for said in self._by_id.get(number, [])]
        return sorted(found, key=lambda said: said.time_s) if len(message_ids) > 1 else found

    def messages(self, *message_ids: int) -> list[tuple[float, Any]]:
        return [(said.time_s, said.message) for said in self.frames(*message_ids)]

    def last(self, message_id: int, until_s: float) -> Said | None:
        """The newest frame of an id at a time."""
        frames = self.frames(message_id)
        count = bisect_right(frames, until_s, key=lambda said: said.time_s)
        return frames[count - 1] if count else None

    @property
    def whole_windows(self) -> Sequence[int]:
        """Windows that lie wholly within the recording."""
        first = int(self.begins_s / self.window_s) + 1
        return range(first, int(self.ends_s / self.window_s))


@dataclass(frozen=True)
class Capture:
    """A recording of a real vehicle and its clients."""

    name: str
    clients: tuple[Said, ...]
    vehicle: Conversation

    def until(self, ends_s: float) -> "Capture":
        """Its beginning, up to a boot time."""
        whole = int(ends_s / self.vehicle.window_s)
        counts = {
            number: {window: count for window, count in windows.items() if window < whole}
            for number, windows in self.vehicle.counts.items()
            if min(windows) < whole
        }
        vehicle = replace(
            self.vehicle,
            ends_s=ends_s,
            counts=counts,
            said=[said for said in self.vehicle.said if said.time_s <= ends_s],
            _by_id={},
        )
        clients = tuple(said for said in self.clients if said.time_s <= ends_s)
        return Capture(self.name, clients, vehicle)


@cache
def read_capture(name: str) -> Capture:
    """A recording in tests/data/captures, as tools/trim_captures.py writes them."""
    rates = json.loads((CAPTURES / f"{name}.json").read_text())
    said = list(_read(gzip.decompress((CAPTURES / f"{name}.tlog.gz").read_bytes())))
    counts = {
        int(number): {int(window): count for window, count in windows.items()}
        for number, windows in rates["counts"].items()
    }
    vehicle = Conversation(
        rates["begins_s"],
        rates["ends_s"],
        [each for each in said if is_vehicle(each.frame)],
        rates["window_s"],
        counts,
    )
    clients = tuple(each for each in said if not is_vehicle(each.frame))
    return Capture(name, clients, vehicle)


def is_vehicle(frame: Frame) -> bool:
    return (frame.system_id, frame.component_id) == VEHICLE


def _read(data: bytes) -> Iterator[Said]:
    framer = Framer()
    position = 0
    while position < len(data):
        (time_us,) = struct.unpack_from(">Q", data, position)
        start = position + 8
        extra = 13 if data[start] == 0xFD and data[start + 2] & 1 else 0
        position = start + data[start + 1] + (12 if data[start] == 0xFD else 8) + extra
        for frame in framer.feed(data[start:position]):
            yield Said(time_us * 1e-6, frame)
