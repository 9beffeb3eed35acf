"""What is more at the end of a flight than at its beginning: live objects, and where from."""

import gc
import sys
import tempfile
import tracemalloc
from collections import Counter, deque
from dataclasses import dataclass
from pathlib import Path

from tools.soak.figure_eight import write_figure_eight
from tools.soak.fly import Glance, fly
from tools.soak.plans import FlightPlan

_FRAMES = 3
"""Of each allocation: more of them make the flight many times slower."""
_BEGINS_S = 60.0
"""Of the trajectory: what grows before is warming up."""
_INTERVAL_S = 10.0
_FEWEST_PER_MINUTE = 5.0
_LONGEST_LIST = 25
_OURS = ("companion", "sitl_shim")
_HOLDERS = (list, dict, set, deque)


@dataclass(frozen=True, slots=True)
class Census:
    """All objects that are alive at a moment, as far as the collector knows them."""

    time_s: float
    by_type: Counter[type]
    items: int
    """In all lists, dicts, sets and deques together."""
    blocks: int
    """Of memory, of Python's allocator."""

    @property
    def objects(self) -> int:
        """All of them."""
        return self.by_type.total()

    @property
    def ours(self) -> int:
        """Objects of the project's own classes."""
        return sum(n for kind, n in self.by_type.items() if str(kind.__module__).startswith(_OURS))


def census(time_s: float) -> Census:
    """Count; garbage is collected first."""
    gc.collect()
    blocks = sys.getallocatedblocks()
    by_type: Counter[type] = Counter()
    items = 0
    for thing in gc.get_objects():
        kind = type(thing)
        by_type[kind] += 1
        if kind in _HOLDERS:
            items += len(thing)
    return Census(time_s, by_type, items, blocks)


def listed(autopilot: str, controller: str | None, faults: str | None, minutes: float) -> list[str]:
    """Fly a figure-eight of so many minutes and list what has grown from the first minute on."""
    seen: list[tuple[Census, tracemalloc.Snapshot]] = []
    begun_s: list[float] = []

    def take(glance: Glance) -> None:
        if glance.phase != "track":
            return
        begun_s[:] = begun_s or [glance.time_s]
        flown_s = glance.time_s - begun_s[0]
        due_s = (_BEGINS_S, minutes * 60.0 - 2.0 * _INTERVAL_S)
        if len(seen) < len(due_s) and flown_s >= due_s[len(seen)]:
            seen.append((census(glance.time_s), tracemalloc.take_snapshot()))

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "figure-eight.csv"
        write_figure_eight(file, minutes * 60.0)
        plan = FlightPlan(autopilot, str(file), controller=controller, faults=faults)
        tracemalloc.start(_FRAMES)
        try:
            outcome = fly(
                plan, Path(folder) / "flight", take, lockstep=True, interval_s=_INTERVAL_S
            )
        finally:
            tracemalloc.stop()
    if len(seen) < 2:
        return [f"the flight was too short: {outcome.outcome} {outcome.note}"]
    (before, first), (after, last) = seen
    flown_min = (after.time_s - before.time_s) / 60.0
    return [
        f"{outcome.outcome} {outcome.note}".rstrip(),
        f"{(after.blocks - before.blocks) / flown_min:+.0f} blocks of memory a minute",
        f"{(after.items - before.items) / flown_min:+.0f} items in lists, dicts, sets a minute",
        f"{(after.ours - before.ours) / flown_min:+.1f} objects of the project a minute",
        *types_more(before, after, flown_min),
        *_places(first, last, flown_min),
    ]


def types_more(before: Census, after: Census, flown_min: float) -> list[str]:
    """Of what there are more, a line for each type, the most first."""
    grown = after.by_type - before.by_type
    return [
        f"{count / flown_min:+10.1f} a minute  {kind.__module__}.{kind.__qualname__}"
        for kind, count in grown.most_common(_LONGEST_LIST)
        if count / flown_min >= _FEWEST_PER_MINUTE
    ]


def _places(first: tracemalloc.Snapshot, last: tracemalloc.Snapshot, flown_min: float) -> list[str]:
    """Where the memory comes from, with the way there."""
    statistics = last.compare_to(first, "traceback")
    told = []
    for place in statistics[:_LONGEST_LIST]:
        kib = place.size_diff / 1024.0 / flown_min
        if kib < 0.1:
            continue
        way = " < ".join(f"{frame.filename}:{frame.lineno}" for frame in reversed(place.traceback))
        told.append(f"{kib:+10.1f} KiB a minute  {way}")
    return told
