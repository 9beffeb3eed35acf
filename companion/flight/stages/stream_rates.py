"""Streams are asked for, then measured: what an autopilot grants is not what it sends."""

import asyncio
from dataclasses import dataclass

from companion.flight.errors import FlightRefusedError
from companion.flight.stages.crew import Flight, FlightScope
from companion.mavlink.dialects.base import Stream
from companion.mavlink.state_source import STATE_MESSAGES
from companion.preflight.streams import NEEDS, SLOW_SHARE

_MEASURED_S = {FlightScope.WHOLE: 1.0, FlightScope.AIRBORNE: 0.5}
_COUNTED_HZ = 10.0
"""Of slower streams too few come in the time: one more might have."""


@dataclass(frozen=True, slots=True)
class Measured:
    """How often a message of the vehicle came."""

    name: str
    rate_hz: float
    asked_hz: float
    least_hz: float
    """Below this there is no flight."""

    @property
    def too_slow(self) -> bool:
        """True if the flight cannot be flown on it."""
        return self.rate_hz < self.least_hz or self.rate_hz <= 0.0

    @property
    def slow(self) -> bool:
        """True if a person should know."""
        return self.rate_hz < SLOW_SHARE * self.asked_hz

    @property
    def text(self) -> str:
        """Which, and how slow."""
        if self.rate_hz <= 0.0:
            return f"{self.name} was granted and does not arrive"
        return f"{self.name} arrives at {self.rate_hz:.0f} Hz, {self.asked_hz:g} Hz were asked for"


@dataclass(frozen=True, slots=True)
class Begun:
    """A measurement that runs."""

    at_s: float
    """By the loop's clock."""
    state_s: float
    """Time of the newest sample of the state, by the autopilot's clock."""
    samples: int
    counts: dict[int, int]


def begin_measuring(flight: Flight) -> Begun | None:
    """Begin to measure; what else is asked of the autopilot meanwhile costs no time of its own.

    Returns:
        What `measure_streams` takes; None if no state comes yet.
    """
    connection = flight.connection
    if connection.state is None:
        return None
    now_s = asyncio.get_running_loop().time()
    state_s = connection.state.time_s
    return Begun(now_s, state_s, connection.samples.count, dict(connection.counts))


async def measure_streams(flight: Flight, begun: Begun | None = None) -> None:
    """Measure the streams that the flight needs, and judge them.

    Streams that do not suffice are measured once more: answers to other questions may have taken
    their room on the link.  What is too slow is asked for again first: a booting autopilot may have
    forgotten, and a request can be lost.

    Args:
        flight: whose state comes.
        begun: a measurement that runs already, to be ended.

    Raises:
        FlightRefusedError: one is too slow for the type of setpoint; named, with the remedy.
    """
    connection = flight.connection
    found = await _measure(flight, begun)
    if any(stream.too_slow for stream in found):
        await connection.request_streams(flight.mission.state_rate_hz)
    if any(stream.too_slow or stream.slow for stream in found):
        found = await _measure(flight)
    remedy = connection.dialect.stream_remedy
    refused = [stream for stream in found if stream.too_slow]
    if refused:
        kind = flight.mission.setpoint
        least = f"{NEEDS[kind].least_hz:g} Hz of the state are needed for {kind} setpoints"
        raise FlightRefusedError(
            f"{'; '.join(stream.text for stream in refused)} (at least {least}). {remedy}."
        )
    for stream in found:
        if stream.slow:
            flight.voice.tell("warning", f"{stream.text}. {remedy}")


async def _measure(flight: Flight, begun: Begun | None = None) -> list[Measured]:
    connection = flight.connection
    first = begun or begin_measuring(flight)
    assert first is not None
    end_s = first.at_s + _MEASURED_S[flight.scope]
    await connection.waiting.pause(max(0.0, end_s - asyncio.get_running_loop().time()))
    last = connection.state
    if last is None:  # the autopilot has restarted: who waits next is told
        return []
    span_s = last.time_s - first.state_s
    state_hz = (connection.samples.count - first.samples) / span_s if span_s > 0.0 else 0.0
    least_hz = NEEDS[flight.mission.setpoint].least_hz
    found = [
        Measured(
            f"the state ({connection.samples.source.names})",
            state_hz,
            flight.mission.state_rate_hz,
            least_hz,
        )
    ]
    if state_hz <= 0.0:
        return found
    flight.stream.punctuality.period_s = connection.loop_seconds(1.0 / state_hz)
    for stream in connection.streams:
        if stream.required and stream.message_id not in STATE_MESSAGES:
            message_id = stream.message_id
            came = connection.counts.get(message_id, 0) - first.counts.get(message_id, 0)
            found.append(_counted(stream, came, span_s))
    return found


def _counted(stream: Stream, came: int, span_s: float) -> Measured:
    asked_hz = 1.0 / stream.interval_s
    if came > 0 and asked_hz < _COUNTED_HZ:
        came += 1
    return Measured(stream.message_id.name, came / span_s, asked_hz, 0.0)
