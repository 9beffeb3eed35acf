"""What may grow by how much, and whether a run kept to it."""

from dataclasses import dataclass

from tools.soak.child import LONG, MANY, REAL_TIME
from tools.soak.plans import ROUND
from tools.soak.runs import Run
from tools.soak.trend import Trend, trend_of

_HOUR_S = 3600.0
_WARM_UP_SHARE = 0.2
_BLOCKS = 12


@dataclass(frozen=True, slots=True)
class Gauge:
    """Something that must not grow."""

    title: str
    key: str
    unit: str
    limit_per_h: float


MEMORY = Gauge("memory", "memory_mib", "MiB", 1.0)
HANDLES = Gauge("file handles", "handles", "handles", 0.0)
TASKS = Gauge("tasks", "tasks", "tasks", 0.0)
LATENCY = Gauge("p99 latency", "p99_ms", "ms", 0.05)
GAUGES = (MEMORY, HANDLES, TASKS, LATENCY)


@dataclass(frozen=True, slots=True)
class Fitted:
    """A gauge of a run."""

    gauge: Gauge
    times_h: list[float]
    """Since the run's beginning."""
    values: list[float]
    warm_up_h: float
    """What comes before is not fitted."""
    trend: Trend

    @property
    def passed(self) -> bool:
        """The slope is not above the limit, with 95 %."""
        return self.trend.upper_per_h <= self.gauge.limit_per_h

    @property
    def word(self) -> str:
        """The verdict: what is not shown may still be so; a longer run tells."""
        if self.passed:
            return "passed"
        return "grows" if self.trend.lower_per_h > self.gauge.limit_per_h else "not shown"

    @property
    def longer(self) -> float | None:
        """How many times as long a run would show that nothing grows; None if this does, or none.

        The slope's error falls with the length to the power of 1.5; it is to be half the limit.
        """
        limit = self.gauge.limit_per_h
        if self.word != "not shown" or limit <= 0.0:
            return None
        margin = self.trend.upper_per_h - self.trend.slope_per_h
        return max(1.0, float((2.0 * margin / limit) ** (2.0 / 3.0)))


def fitted(run: Run) -> list[Fitted]:
    """All gauges of a run.

    Raises:
        ValueError: the run was too short.
    """
    return [_fit(run, gauge) for gauge in GAUGES]


def _fit(run: Run, gauge: Gauge) -> Fitted:
    samples = run.latencies if gauge is LATENCY else run.samples
    begun_s = 0.0 if run.name == MANY else run.samples[0]["time_s"]
    times_h = [(sample["time_s"] - begun_s) / _HOUR_S for sample in samples]
    values = [float(sample[gauge.key]) for sample in samples]
    first = round(_WARM_UP_SHARE * len(values))
    block = max(1, (len(values) - first) // _BLOCKS)
    if run.name == MANY:
        # A block is a round, in which each kind of flight is flown once.
        first = -(-first // ROUND) * ROUND
        block = ROUND
    try:
        trend = trend_of(times_h[first:], values[first:], block)
    except ValueError as error:
        raise ValueError(f"{run.name}: too short for a verdict on {gauge.title}: {error}") from None
    return Fitted(gauge, times_h, values, times_h[first], trend)


def unplanned_endings(run: Run) -> list[str]:
    """Flights that did not land after their whole trajectory."""
    return [
        f"{run.name}, flight {number}: {flight['outcome']} {flight['note']}".rstrip()
        for number, flight in enumerate(run.flights, 1)
        if flight["outcome"] != "landed" or not flight["completed"]
    ]


LATENCY_MEANS = {
    REAL_TIME: "from a sample's arrival to its setpoint's departure, in windows of 10 s",
    LONG: "processor time of the controller, in windows of 60 s",
    MANY: "processor time of the controller, of each flight",
}
