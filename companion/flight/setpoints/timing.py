"""How punctual the loop is: latencies, missed deadlines, and the machine's own timer noise."""

import asyncio
from dataclasses import dataclass, field

import numpy as np

DEADLINE_S = 0.005
"""A setpoint must leave within this after the sample came."""


@dataclass(frozen=True, slots=True)
class Percentiles:
    """Of a set of times, ms."""

    p50: float
    p99: float
    max: float


def percentiles_ms(times_s: list[float]) -> Percentiles | None:
    """Percentiles of times in seconds; None of no times."""
    if not times_s:
        return None
    p50, p99, highest = np.percentile(np.array(times_s) * 1e3, [50.0, 99.0, 100.0])
    return Percentiles(round(float(p50), 3), round(float(p99), 3), round(float(highest), 3))


@dataclass(slots=True)
class Punctuality:
    """Counts ticks and late ones."""

    period_s: float
    """Of the samples, by the loop's clock."""
    latencies_s: list[float] = field(default_factory=list)
    """From a sample's arrival to its setpoint's departure."""
    ticks: int = 0
    missed_deadlines: int = 0
    _last_s: float | None = None

    def tick(self, received_s: float, sent_s: float) -> None:
        """A setpoint left at `sent_s` for a sample that came at `received_s`."""
        self.ticks += 1
        self.latencies_s.append(sent_s - received_s)
        late = sent_s - received_s > DEADLINE_S
        if self._last_s is not None and sent_s - self._last_s > 2.0 * self.period_s + DEADLINE_S:
            late = True
        if late:
            self.missed_deadlines += 1
        self._last_s = sent_s

    def pause(self) -> None:
        """The stream stops: the next tick follows no other."""
        self._last_s = None


async def measure_timer_noise(overshoots_s: list[float], interval_s: float = 0.01) -> None:
    """Sleep again and again, until cancelled, and note how late the loop wakes up, s."""
    loop = asyncio.get_running_loop()
    while True:
        due = loop.time() + interval_s
        await asyncio.sleep(interval_s)
        overshoots_s.append(loop.time() - due)
