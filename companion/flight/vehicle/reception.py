"""From the link's bytes to frames that there is time for, now or at the end of a turn."""

import asyncio
from collections.abc import Callable

from companion.flight.vehicle.intake import Gate, Intake
from companion.link.link import Link
from companion.mavlink.framing import Frame, Framer

_FLOOD = (
    "more comes over the link than there is time for: the newest of what the flight needs is kept, "
    "the rest is dropped and counted"
)
_FLOODED_TURNS = 25
"""In a row, half a second: a burst is no flood."""
_FLOODED_TURNS_UNTIMED = 100
"""The same while the pace of the vehicle's clock is not known: it may be a simulation in fast
motion."""


class Reception:
    """The intake of a link, with the loop's clock."""

    def __init__(
        self,
        link: Link,
        framer: Framer,
        gate: Gate,
        pace: Callable[[], float | None],
        deal_with: Callable[[list[Frame], float], None],
    ) -> None:
        """Prepare.

        Args:
            link: where the bytes come from.
            framer: cuts the stream.
            gate: who is let in.
            pace: of the vehicle's clock by ours; None while that is not known.
            deal_with: given frames, in order, and the loop's time.
        """
        self.on_flood: Callable[[str], None] | None = None
        """Told once if for a while more comes from the peer than there is time for."""
        self.flooded = False
        """That has been so.  What is dropped after a pause of this process, or in a burst, is no
        flood."""
        self._intake = Intake(framer, gate, link.counters)
        self._link = link
        self._pace = pace
        self._deal_with = deal_with
        self._turn_ends: asyncio.TimerHandle | None = None

    @property
    def held_bytes(self) -> int:
        """How much waits for the turn's end."""
        return self._intake.held_bytes

    @property
    def flood_remark(self) -> str:
        """What was dropped of what the peer sent; empty if nothing was."""
        counters = self._link.counters
        if not (counters.excess_packets or counters.excess_bytes):
            return ""
        why = (
            "because there were too many: the vehicle, or who sends in its name, floods the link"
            if self.flooded
            else "because they came all at once: in a burst, or piled up while the companion or "
            "the link stood still. What is left of each time is the newest"
        )
        return (
            f"of what came over the link, {counters.excess_packets} packets and "
            f"{counters.excess_bytes} bytes beside were dropped {why}"
        )

    def take(self, data: bytes, received_s: float) -> None:
        """Take bytes from the link."""
        intake, pace = self._intake, self._pace()
        intake.pace = pace if pace is not None and pace > 1.0 else 1.0
        frames = intake.take(data, received_s, whole=self._link.datagrams)
        self._deal_with(frames, received_s)
        if intake.due_s is not None:
            self._wait_for_the_turns_end()
        if not intake.flooded_turns or self.flooded:
            return
        if intake.flooded_turns >= (_FLOODED_TURNS_UNTIMED if pace is None else _FLOODED_TURNS):
            self.flooded = True
            if self.on_flood is not None:
                self.on_flood(_FLOOD)

    def break_off(self) -> None:
        """What was begun has no continuation: the link was lost."""
        self._intake.break_off()

    def _wait_for_the_turns_end(self) -> None:
        due_s = self._intake.due_s
        if due_s is not None and self._turn_ends is None:
            self._turn_ends = asyncio.get_running_loop().call_at(due_s, self._on_turn_end)

    def _on_turn_end(self) -> None:
        """Deal with what a flood left for later: the newest of what the flight rests on."""
        self._turn_ends = None
        now = asyncio.get_running_loop().time()
        due_s = self._intake.due_s
        if due_s is not None and due_s <= now:  # else a turn has begun in the meantime
            self._deal_with(self._intake.release(now, whole=self._link.datagrams), now)
        self._wait_for_the_turns_end()
