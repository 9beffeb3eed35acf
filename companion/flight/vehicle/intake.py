"""How much of what comes in is dealt with: a flood must not take the loop from the setpoints.

Time is cut into turns.  In each, so many packets are looked at, and of those that are let in so
many are dealt with; both are several times what an autopilot sends at full rate.  What is beyond
is dropped and counted, and what the flight rests on is dropped last: of the vehicle's state, its
heartbeats and its answers the newest of each kind is kept until the turn's end.  Below the limits
everything passes at once and in order.

What piled up while this process, or the link, stood still is no flood: a turn that follows a pause
may hold as much more.

Pure: bytes and times in, frames out.
"""

from collections.abc import Callable
from typing import NamedTuple

from companion.link.link import LinkCounters
from companion.mavlink.framing import Frame, Framer
from companion.mavlink.messages import COMPONENT_TRUTH, MessageId
from companion.mavlink.state_source import STATE_MESSAGES

TURN_S = 0.02
"""The setpoint watch looks as often."""
BUDGET_BYTES = 16_384
"""Dealt with in a turn.

PX4 sends some 400 packets/s and 24 kB/s to a companion, and with a state of 100 Hz 45 kB/s: less
than 1 kB and ten packets in a turn, 2 kB as they are charged here.  Eight times that leaves room
for bursts: the fullest turns of simulated flights, with parameters read, come to 5.8 kB.  Dealing
with 16 kB takes about 4 ms of the turn's 20 in any mixture.
"""
MOST_TURNS = 10.0
"""After a pause, so many turns' budgets are dealt with in one: more than a second of what an
autopilot sends at full rate (141 kB/s as charged here), in 40 ms at most."""
_SMALLEST_CHARGE = 80
"""A packet costs time, however short it is."""
STATE_CHARGE = 512
"""A controller runs at each sample."""
RESERVE = 8
"""Of each essential kind so many are dealt with in a turn, whatever else comes."""
LOOKS = 2000
"""Starts of packets that are looked at in a turn; each takes 1 to 3 µs."""
HELD_BYTES = 16_384
"""Of what is not looked at in a turn, so much, the newest, is looked at at its end: of packets,
however short, that takes less than the looks of a turn."""
_PIECE = 2048
"""Bytes that are looked at before the looks are counted."""

_ESSENTIAL = STATE_MESSAGES | {
    int(message)
    for message in (
        MessageId.HEARTBEAT,
        MessageId.SYS_STATUS,
        MessageId.COMMAND_ACK,
        MessageId.TIMESYNC,
        MessageId.EKF_STATUS_REPORT,
        MessageId.ESTIMATOR_STATUS,
        MessageId.EXTENDED_SYS_STATE,
        MessageId.STATUSTEXT,
        MessageId.CURRENT_MODE,
    )
}
_TRUTH = frozenset(
    (
        MessageId.ODOMETRY,
        MessageId.DEBUG_VECT,
        MessageId.NAMED_VALUE_FLOAT,
        MessageId.HIL_STATE_QUATERNION,
    )
)
"""What a simulation tells the recorder: without it a flight has no tracking error."""

Kind = tuple[int, int]
"""Component and message id."""


class Gate(NamedTuple):
    """What the intake asks of others."""

    admit: Callable[[list[Frame]], list[Frame]]
    """The frames that may be read, in order."""
    note: Callable[[Frame, float], None]
    """Told of each frame that was let in, before anything else, with the time."""
    is_vehicle: Callable[[Frame], bool]
    """True for a frame of the vehicle, or of whoever may become it."""


class Intake:
    """Makes frames of bytes, as many as there is time for."""

    def __init__(self, framer: Framer, gate: Gate, counters: LinkCounters) -> None:
        """Prepare.

        Args:
            framer: cuts the stream.
            gate: who is let in, and who is the vehicle.
            counters: where what is dropped is counted.
        """
        self.pace = 1.0
        """Of the vehicle's clock by ours: a simulation in fast motion sends as much more."""
        self._framer = framer
        self._gate = gate
        self._counters = counters
        self._turn_s: float | None = None
        """When the turn began; None before the first."""
        self.flooded_turns = 0
        """Turns in a row, up to the last one that ended, for which more came than there is time
        for, the pause before them reckoned in."""
        self._turns = 1.0
        """How long before this turn the last one began, in turns."""
        self._granted = 1.0
        """How many turns' budgets this one has."""
        self._came = 0.0
        """In this turn, as charged."""
        self._spent = 0.0
        self._looked = 0
        self._reserve: dict[Kind, int] = {}
        self._held: dict[Kind, Frame] = {}
        self._tail = b""
        """The newest of what was not looked at."""

    @property
    def due_s(self) -> float | None:
        """When `release` is to be called, by the loop's time; None if nothing is held."""
        if not (self._tail or self._held) or self._turn_s is None:
            return None
        return self._turn_s + TURN_S

    @property
    def held_bytes(self) -> int:
        """How much waits for the turn's end."""
        return len(self._tail) + sum(len(frame.raw) for frame in self._held.values())

    def take(self, data: bytes, now_s: float, *, whole: bool) -> list[Frame]:
        """Take what came in.

        Args:
            data: the next bytes of a stream, or one datagram or several.
            now_s: the loop's time.
            whole: no packet goes on in the next data.

        Returns:
            The frames to be dealt with now, in order.
        """
        frames = []
        if self._turn_s is None or now_s - self._turn_s >= TURN_S:
            frames = self.release(now_s, whole=whole)
        if self._tail:
            self._hold(data)
            return frames
        new = self._sift(self._look(data, now_s, whole))
        return frames + new if frames else new

    def release(self, now_s: float, *, whole: bool) -> list[Frame]:
        """Begin a turn; give what was held until its beginning."""
        self._grant(now_s)
        self._spent, self._looked = 0.0, 0
        self._reserve.clear()
        held, self._held = list(self._held.values()), {}
        tail, self._tail = self._tail, b""
        if tail:
            held += self._look(tail, now_s, whole)
        frames = self._sift(held) if held else held
        self._came = 0.0  # that came in the turn before
        return frames

    def _grant(self, now_s: float) -> None:
        """How much the turn that begins may hold.

        One that follows more than there was time for has no share of a pause: on a computer that
        takes long over a flood, each turn would last as long as the one before.
        """
        flooded = self._came > BUDGET_BYTES * self.pace * self._turns
        self.flooded_turns = self.flooded_turns + 1 if flooded else 0
        self._turns = 1.0 if self._turn_s is None else max(1.0, (now_s - self._turn_s) / TURN_S)
        self._granted = 1.0 if flooded else min(self._turns, MOST_TURNS)
        self._turn_s = now_s

    def break_off(self) -> None:
        """What was begun has no continuation: the link was lost."""
        self._framer.finish()
        self._tail = b""

    def _look(self, data: bytes, now_s: float, whole: bool) -> list[Frame]:
        """Frames that are let in, of as much as may be looked at; the rest is held."""
        framer = self._framer
        before = framer.looks
        if len(data) <= _PIECE:
            frames = framer.feed(data) if self._looked < LOOKS else self._hold(data)
        else:
            frames = []
            for start in range(0, len(data), _PIECE):
                if self._looked + framer.looks - before >= LOOKS:
                    self._hold(data[start:])
                    break
                frames += framer.feed(data[start : start + _PIECE])
        if whole and not self._tail and framer.pending_bytes:
            # What looks like the start of a packet is none: the rest will never come.
            frames += framer.finish()
        looks = framer.looks - before
        self._looked += looks if looks > 1 else 1
        admit, note, _ = self._gate
        frames = admit(frames)
        for frame in frames:
            note(frame, now_s)
        return frames

    def _hold(self, data: bytes) -> list[Frame]:
        """Keep the newest bytes for the turn's end; always gives no frames."""
        self._came += max(len(data), BUDGET_BYTES * self.pace)
        waiting = self._tail + data[-HELD_BYTES:]
        self._counters.excess_bytes += len(self._tail) + len(data)
        self._tail = waiting[-HELD_BYTES:]
        self._counters.excess_bytes -= len(self._tail)
        if len(waiting) > HELD_BYTES or len(data) > HELD_BYTES:
            # What was begun goes on in bytes that are gone.
            self._framer.finish()
        return []

    def _sift(self, frames: list[Frame]) -> list[Frame]:
        """The frames that there is time for, in order; of the essential ones some are held."""
        came = 0
        for frame in frames:
            came += _charge(frame)
        self._came += came
        spent = self._spent + came
        budget = BUDGET_BYTES * self.pace * self._granted
        if spent <= budget:
            self._spent = spent
            return frames
        kept: list[Frame] = []
        seen: set[Kind] = set()
        # From the newest to the oldest: what is dropped is old.
        for frame in reversed(frames):
            charge, kind = _charge(frame), self._essential_kind(frame)
            if kind is not None and kind in seen and frame.message_id in STATE_MESSAGES:
                self._counters.excess_packets += 1
            elif self._spent + charge <= budget or self._reserved(kind):
                self._spent += charge
                kept.append(frame)
                if kind is not None and self._held.pop(kind, None) is not None:
                    self._counters.excess_packets += 1
            else:
                self._counters.excess_packets += 1
                if kind is not None and kind not in seen:
                    # One is dropped all the same: this one, or the one that it takes the place of.
                    self._counters.excess_packets -= kind not in self._held
                    self._held.pop(kind, None)
                    self._held[kind] = frame
            if kind is not None:
                seen.add(kind)
        kept.reverse()
        return kept

    def _reserved(self, kind: Kind | None) -> bool:
        """Take one of an essential kind's reserve, if any is left."""
        if kind is None:
            return False
        used = self._reserve.get(kind, 0)
        self._reserve[kind] = used + 1
        return used < RESERVE * self.pace

    def _essential_kind(self, frame: Frame) -> Kind | None:
        """The kind of what the flight rests on; None for all else."""
        message_id, component_id = frame.message_id, frame.component_id
        if component_id == COMPONENT_TRUTH:
            return (component_id, message_id) if message_id in _TRUTH else None
        if message_id in _ESSENTIAL and self._gate.is_vehicle(frame):
            return (component_id, message_id)
        return None


def _charge(frame: Frame) -> int:
    """What dealing with a frame costs, in bytes of the budget."""
    if frame.message_id in STATE_MESSAGES and frame.component_id != COMPONENT_TRUTH:
        return STATE_CHARGE
    size = len(frame.raw)
    return size if size > _SMALLEST_CHARGE else _SMALLEST_CHARGE
