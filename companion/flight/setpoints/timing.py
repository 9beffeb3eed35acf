"""How punctual the loop is: latencies, missed deadlines, and the machine's own timer noise."""

import asyncio
import math
from array import array
from collections.abc import Iterable
from dataclasses import dataclass, field

DEADLINE_S = 0.005
"""A setpoint must leave within this after the sample came."""

_LOWEST_S, _HIGHEST_S = 1e-7, 1e3
_LOG_RATIO = math.log(1.01)
_BINS = math.ceil(math.log(_HIGHEST_S / _LOWEST_S) / _LOG_RATIO) + 2
"""The first holds all below the lowest, the last all above the highest."""


@dataclass(frozen=True, slots=True)
class Percentiles:
    """Of a set of times, ms."""

    p50: float
    p99: float
    max: float


class Times:
    """As many times as there may be, in a memory that does not grow: for percentiles.

    Bins 1 % wide, from 0.1 µs to 1000 s, each hold how many times fell into them and their sum.
    The mean of its bin stands for a time, so a percentile is off by less than 1 %, and not at all
    while no two times share a bin.  The greatest is exact.
    """

    __slots__ = ("_counts", "_greatest_s", "_sums_s", "count")

    def __init__(self, times_s: Iterable[float] = ()) -> None:
        self._counts = array("Q", bytes(8 * _BINS))
        self._sums_s = array("d", bytes(8 * _BINS))
        self._greatest_s = -math.inf
        self.count = 0
        for time_s in times_s:
            self.add(time_s)

    def add(self, time_s: float) -> None:
        """Take one more, finite, s."""
        where = 0
        if time_s > _LOWEST_S:
            where = min(_BINS - 1, 1 + int(math.log(time_s / _LOWEST_S) / _LOG_RATIO))
        self._counts[where] += 1
        self._sums_s[where] += time_s
        self._greatest_s = max(self._greatest_s, time_s)
        self.count += 1

    def percentile_s(self, percent: float) -> float:
        """As numpy's: interpolated between the two times of the nearest ranks, s.

        Raises:
            ValueError: there are no times.
        """
        if not self.count:
            raise ValueError("no times, no percentiles")
        place = percent / 100.0 * (self.count - 1)
        below = math.floor(place)
        low, high = self._ranked(below), self._ranked(min(below + 1, self.count - 1))
        return low + (place - below) * (high - low)

    def _ranked(self, rank: int) -> float:
        """The time of a rank, 0 being the least, as far as the bins tell."""
        if rank == self.count - 1:
            return self._greatest_s
        passed = 0
        for count, sum_s in zip(self._counts, self._sums_s, strict=True):
            passed += count
            if passed > rank:
                return sum_s / count
        raise AssertionError("unreachable: a rank is below the count")


def percentiles_ms(times: Times) -> Percentiles | None:
    """Percentiles of times; None of no times."""
    if not times.count:
        return None
    p50, p99, highest = (1e3 * times.percentile_s(percent) for percent in (50.0, 99.0, 100.0))
    return Percentiles(round(p50, 3), round(p99, 3), round(highest, 3))


@dataclass(slots=True)
class Punctuality:
    """Counts ticks and late ones."""

    period_s: float
    """Of the samples, by the loop's clock."""
    latencies: Times = field(default_factory=Times)
    """From a sample's arrival to its setpoint's departure."""
    ticks: int = 0
    missed_deadlines: int = 0
    _last_s: float | None = None

    def tick(self, received_s: float, sent_s: float) -> None:
        """A setpoint left at `sent_s` for a sample that came at `received_s`."""
        self.ticks += 1
        self.latencies.add(sent_s - received_s)
        late = sent_s - received_s > DEADLINE_S
        if self._last_s is not None and sent_s - self._last_s > 2.0 * self.period_s + DEADLINE_S:
            late = True
        if late:
            self.missed_deadlines += 1
        self._last_s = sent_s

    def pause(self) -> None:
        """The stream stops: the next tick follows no other."""
        self._last_s = None


async def measure_timer_noise(overshoots: Times, interval_s: float = 0.01) -> None:
    """Sleep again and again, until cancelled, and note how late the loop wakes up."""
    loop = asyncio.get_running_loop()
    while True:
        due = loop.time() + interval_s
        await asyncio.sleep(interval_s)
        overshoots.add(loop.time() - due)
