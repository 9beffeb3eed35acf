"""One fault of one link in one direction: what it makes of a datagram."""

from collections.abc import Sequence
from math import ceil, inf

from sitl_shim.faults.link_draws import Draws, Of, Silences, changed
from sitl_shim.faults.schema import LinkFault
from sitl_shim.wind.events import Moments

Due = tuple[float, bytes]
"""Simulated time since boot (s) at which bytes go on, and the bytes."""

_BUNCH_S = 0.001
"""Babble at a higher rate than this comes in bunches."""
_ROUNDING = 1e-9


class LinkStage:
    """One fault of one link in one direction; no clock, no I/O.

    Within a fault this is the order: pause, bursts and loss; corruption; duplication; here babble
    joins; bandwidth; delay with jitter; reordering.

    Args:
        fault: what it does.
        moments: what its times count from.
        seed: of the flight.
        key: the fault's place in its file, direction and link: each has draws of its own.
        babble: packets to babble with, one after another, over and over.
    """

    __slots__ = (
        "_babble",
        "_babbled",
        "_draws",
        "_fault",
        "_free_at_s",
        "_last_due_s",
        "_moments",
        "_silences",
    )

    def __init__(
        self,
        fault: LinkFault,
        moments: Moments,
        seed: int,
        key: tuple[int, ...],
        babble: Sequence[bytes],
    ) -> None:
        self._fault = fault
        self._moments = moments
        self._draws = tuple(Draws(seed, (*key, of)) for of in Of)
        self._silences = (
            None if fault.bursts is None else Silences(fault.bursts, self._draws[Of.BURSTS])
        )
        self._babble = babble
        self._babbled = 0
        self._free_at_s = -inf
        """When the last byte that waits for the bandwidth has left."""
        self._last_due_s = -inf

    def take(self, time_s: float, data: bytes) -> list[Due]:
        """What goes on, and when, of a datagram that comes at a time; times must not decrease."""
        begin_s, end_s = self._stretch_s()
        fault = self._fault
        if not begin_s <= time_s < end_s:
            # What the fault still holds is not overtaken once it is over.
            return [(max(time_s, self._last_due_s) if fault.keep_order else time_s, data)]
        draws = self._draws
        # Each is drawn for each datagram, so that no share changes what another one hits.
        lost = draws[Of.LOSS].hits(fault.loss)
        corrupted = draws[Of.CORRUPTION].hits(fault.corrupt)
        twice = draws[Of.DUPLICATION].hits(fault.duplicate)
        late = draws[Of.REORDERING].hits(fault.reorder)
        shift = draws[Of.JITTER].next() if fault.jitter_s > 0.0 else 0.5
        silent = self._silences is not None and self._silences.cover(time_s, begin_s)
        if fault.pause or lost or silent:
            return []
        if corrupted and data:
            data = changed(data, draws[Of.CHANGES])
        going = self._carry(time_s, data, shift, end_s, late=late)
        if twice:
            going += self._carry(time_s, data, self._extra_shift(), end_s)
        return going

    def take_babble(self, time_s: float, data: bytes) -> list[Due]:
        """The same for a packet of `babble`."""
        return self._carry(time_s, data, self._extra_shift(), self._stretch_s()[1])

    @property
    def next_babble_s(self) -> float:
        """When the next packet of babble comes; infinite if there is none, or it isn't known."""
        rate_hz = self._fault.babble_packets_s
        if rate_hz == 0.0:
            return inf
        begin_s, end_s = self._stretch_s()
        after_s = self._babbled / rate_hz
        if rate_hz * _BUNCH_S > 1.0:
            after_s = ceil(after_s / _BUNCH_S - _ROUNDING) * _BUNCH_S
        time_s = begin_s + after_s
        return time_s if time_s < end_s else inf

    def babble(self, until_s: float) -> list[Due]:
        """The packets of babble that come up to a time and were not yet taken."""
        found: list[Due] = []
        while (time_s := self.next_babble_s) <= until_s and self._babble:
            found.append((time_s, self._babble[self._babbled % len(self._babble)]))
            self._babbled += 1
        return found

    def _stretch_s(self) -> tuple[float, float]:
        """Since boot, from when on and until when it acts."""
        fault = self._fault
        origin_s = self._moments.setpoints_s if fault.since == "setpoints" else 0.0
        return origin_s + fault.from_s, inf if fault.until_s is None else origin_s + fault.until_s

    def _extra_shift(self) -> float:
        return self._draws[Of.EXTRA_JITTER].next() if self._fault.jitter_s > 0.0 else 0.5

    def _carry(
        self, time_s: float, data: bytes, shift: float, end_s: float, *, late: bool = False
    ) -> list[Due]:
        """Send a datagram on its way: none, or the one with its time.

        Args:
            time_s: at which it comes.
            data: its bytes.
            shift: where in its range the jitter lies, 0 to 1.
            end_s: when the fault ends.
            late: whether others may overtake it.
        """
        fault = self._fault
        if fault.bandwidth_bytes_s is not None:
            waiting_bytes = max(0.0, self._free_at_s - time_s) * fault.bandwidth_bytes_s
            if waiting_bytes > 0.0 and waiting_bytes + len(data) > fault.queue_bytes:
                return []
            self._free_at_s = max(self._free_at_s, time_s) + len(data) / fault.bandwidth_bytes_s
            # When the limit is lifted, all that waits goes at once.
            time_s = min(self._free_at_s, end_s)
        due_s = time_s + max(0.0, fault.delay_s + fault.jitter_s * (2.0 * shift - 1.0))
        if fault.keep_order:
            due_s = max(due_s, self._last_due_s)
        if late:
            return [(due_s + fault.reorder_by_s, data)]
        self._last_due_s = max(self._last_due_s, due_s)
        return [(due_s, data)]
