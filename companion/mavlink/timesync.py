"""The autopilot's clock against ours, from TIMESYNC exchanges.

Protocol: https://mavlink.io/en/services/timesync.html.  We send our time, the autopilot sends it
back with its own.  Half the round trip is taken for each way.  A straight line through the last
exchanges, those with short round trips weighing most, gives offset and rate: an autopilot in a
simulation may run anywhere between 0.9 and 20 times as fast as our clock.

The questions also tell whether the way to the vehicle is open: while it is heard and answers none
of them, what is sent to it does not arrive.

Delays that vary tilt the line, most of all while it is short.  So the rate is the one nearest to 1
that the exchanges allow: at first, each may be wrong by half its round trip; once they span two
seconds, by what its round trip has over the shortest one.
"""

import math
import struct
from collections import deque
from typing import NamedTuple

from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId, Outgoing

_WIRE = struct.Struct("<qq")
_KEPT = 64
_OUTSTANDING = 32
_ENOUGH = 3
_ENOUGH_SPAN_S = 0.5
_LONG_SPAN_S = 2.0
_SLOWEST_ANSWER_S = 1.0
_JITTER_FLOOR_S = 2.0e-4
_SIGMAS = 1.5
"""How much of the expected error of a long line is taken for possible."""
_JITTER_SHARE = 0.3
"""Of the usual lateness: equally short round trips may be shared differently by both ways."""
_JUMP_S = 0.5
_JUMPS_TO_BELIEVE = 3
_BURST = 10
_BURST_INTERVAL_S = 0.1
INTERVAL_S = 0.25
"""Between questions, but for the first few."""
_PRESENT = 4
"""Exchanges that tell how the link is now: of the last second, if none is lost."""
_SLOWER_S = 0.02
"""Round trips longer by this, all of them, are a link that has become slower."""


def boot_time_s(frame: Frame) -> float:
    """The autopilot's time since boot in a TIMESYNC of its own, question or answer, s."""
    tc1, ts1 = _WIRE.unpack_from(frame.payload.ljust(_WIRE.size, b"\0"))
    return float(tc1 or ts1) * 1e-9


def is_answer(frame: Frame) -> bool:
    """True if a TIMESYNC answers a question, instead of asking one."""
    return bool(_WIRE.unpack_from(frame.payload.ljust(_WIRE.size, b"\0"))[0])


class _Sample(NamedTuple):
    middle_s: float
    """Our time half-way between request and answer."""
    autopilot_s: float
    round_trip_s: float


class ClockEstimator:
    """Asks for the autopilot's time and keeps a line through the answers."""

    __slots__ = (
        "_anchor_autopilot_s",
        "_anchor_s",
        "_due_s",
        "_jumps",
        "_samples",
        "_sent_ns",
        "_sent_total",
        "_unanswered_s",
        "rate",
        "valid",
        "way_there_s",
    )

    def __init__(self) -> None:
        self._samples: deque[_Sample] = deque(maxlen=_KEPT)
        self._sent_ns: deque[int] = deque(maxlen=_OUTSTANDING)
        self._sent_total = 0
        self._unanswered_s: deque[float] = deque(maxlen=_OUTSTANDING)
        """When each question was asked since the newest one that was answered; oldest first."""
        self._due_s = -math.inf
        self._jumps = 0
        # These are read at every frame, and change with an exchange alone.
        self.valid = False
        """True once enough exchanges agree for `autopilot_time` to mean something."""
        self.rate = 1.0
        """Seconds of the autopilot's clock per second of ours."""
        self.way_there_s = math.nan
        """How long what is sent now takes to the autopilot, by its clock; NaN before the first
        exchange.  See `_way_there_s`."""
        self._anchor_s = 0.0
        self._anchor_autopilot_s = 0.0

    @property
    def round_trip_s(self) -> float:
        """Shortest round trip among the last exchanges, by our clock; NaN before the first."""
        return min((sample.round_trip_s for sample in self._samples), default=math.nan)

    def _way_there_s(self) -> float:
        """How long what is sent now takes to the autopilot, by its clock.

        Half of the shortest round trip among the last; where the link has become slower, what an
        answer's own age leaves of the round trip: which of the two ways it was then tells.
        """
        shortest_s = self.round_trip_s
        present = min(list(self._samples)[-_PRESENT:], key=lambda s: s.round_trip_s)
        if present.round_trip_s <= shortest_s + _SLOWER_S:
            return 0.5 * shortest_s * self.rate
        came_s = present.middle_s + 0.5 * present.round_trip_s
        back_s = self.autopilot_time(came_s) - present.autopilot_s
        return max(0.0, present.round_trip_s * self.rate - back_s)

    def unanswered_since(self, since_s: float) -> float:
        """When the first question was asked of those after `since_s` that nobody has answered.

        Only questions count that are younger than the newest one that was answered.

        Returns:
            Our time; infinity if there is none.
        """
        for asked_s in self._unanswered_s:
            if asked_s >= since_s:
                return asked_s
        return math.inf

    @property
    def round_trips_s(self) -> tuple[float, ...]:
        """Of the last exchanges, by our clock, oldest first."""
        return tuple(sample.round_trip_s for sample in self._samples)

    @property
    def due_s(self) -> float:
        """When to call `outgoing` next (loop time)."""
        return self._due_s

    def autopilot_time(self, now_s: float) -> float:
        """The autopilot's time since boot at our `now_s`; meaningless until `valid`."""
        return self._anchor_autopilot_s + self.rate * (now_s - self._anchor_s)

    def outgoing(self, now_s: float) -> list[Outgoing]:
        """A TIMESYNC request, if one is due: ten quickly, then four a second."""
        if now_s < self._due_s:
            return []
        sent_ns = round(now_s * 1e9)
        self._sent_ns.append(sent_ns)
        self._sent_total += 1
        self._unanswered_s.append(now_s)
        self._due_s = now_s + (_BURST_INTERVAL_S if self._sent_total < _BURST else INTERVAL_S)
        return [Outgoing(MessageId.TIMESYNC, _WIRE.pack(0, sent_ns))]

    def on_timesync(self, now_s: float, frame: Frame) -> list[Outgoing]:
        """Take a TIMESYNC of the autopilot: use an answer to us, answer a question of its own."""
        tc1, ts1 = _WIRE.unpack_from(frame.payload.ljust(_WIRE.size, b"\0"))
        if tc1 == 0:
            ours_ns = max(1, round(now_s * 1e9))  # 0 would make it a question again
            return [Outgoing(MessageId.TIMESYNC, _WIRE.pack(ours_ns, ts1))]
        if ts1 in self._sent_ns:  # else: an answer to somebody else's question
            self._sent_ns.remove(ts1)
            asked_s = ts1 * 1e-9
            while self._unanswered_s and self._unanswered_s[0] <= asked_s + 1e-6:
                self._unanswered_s.popleft()
            round_trip_s = now_s - asked_s
            if 0.0 <= round_trip_s <= _SLOWEST_ANSWER_S:
                self._take(_Sample(now_s - round_trip_s / 2.0, tc1 * 1e-9, round_trip_s))
        return []

    def _take(self, sample: _Sample) -> None:
        """Add an exchange, unless it contradicts the others; start over if several do."""
        if self.valid:
            surprise = sample.autopilot_s - self.autopilot_time(sample.middle_s)
            if abs(surprise) > _JUMP_S * max(1.0, self.rate):
                self._jumps += 1
                if self._jumps < _JUMPS_TO_BELIEVE:
                    return
                self._samples.clear()  # the autopilot has restarted, or its clock was set
        self._jumps = 0
        self._samples.append(sample)
        self._fit()
        self.valid = len(self._samples) >= _ENOUGH and self._span_s >= _ENOUGH_SPAN_S
        self.way_there_s = self._way_there_s()

    @property
    def _span_s(self) -> float:
        """Our time from the first sample to the last; there must be one."""
        return self._samples[-1].middle_s - self._samples[0].middle_s

    def _fit(self) -> None:
        """Weighted straight line through the samples, anchored at the newest one's time."""
        round_trips_s = sorted([sample.round_trip_s for sample in self._samples])
        shortest_s = round_trips_s[0]
        usual_s = round_trips_s[len(round_trips_s) // 2]
        floor_s = _JITTER_FLOOR_S + _JITTER_SHARE * (usual_s - shortest_s)
        short = self._span_s < _LONG_SPAN_S
        newest = self._samples[-1]
        newest_s, newest_autopilot_s, _ = newest
        weight_sum = x_sum = y_sum = 0.0
        points: list[tuple[float, float, float, float]] = []
        for middle_s, autopilot_s, round_trip_s in self._samples:
            late_s = round_trip_s - shortest_s + floor_s
            weight = (floor_s / late_s) ** 2
            doubt_s = round_trip_s if short else late_s
            x = middle_s - newest_s
            y = autopilot_s - newest_autopilot_s
            points.append((weight, x, y, 0.5 * doubt_s))
            weight_sum += weight
            x_sum += weight * x
            y_sum += weight * y
        x_mean, y_mean = x_sum / weight_sum, y_sum / weight_sum
        covariance = sum([w * (x - x_mean) * (y - y_mean) for w, x, y, _ in points])
        variance = sum([w * (x - x_mean) ** 2 for w, x, _, _ in points])
        self.rate = 1.0
        if variance > 0.0:
            fitted = covariance / variance
            doubts = [w * abs(x - x_mean) * d for w, x, _, d in points]
            # A few may well err all the same way; many do not.
            doubt = (sum(doubts) if short else _SIGMAS * math.hypot(*doubts)) / variance
            lowest, highest = fitted * (1.0 - doubt), fitted * (1.0 + doubt)
            self.rate = min(max(1.0, lowest), highest)
        self._anchor_s = newest.middle_s
        self._anchor_autopilot_s = newest.autopilot_s + y_mean - self.rate * x_mean
