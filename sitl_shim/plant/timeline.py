"""The events of a flight, at the steps of the plant at which they happen."""

from collections.abc import Sequence
from math import ceil, isfinite
from typing import Generic, TypeVar

from sitl_shim.wind import Moments, Timed

_Event = TypeVar("_Event", bound=Timed)


class Timeline(Generic[_Event]):
    """Events, taken one after another.

    Args:
        events: those of the same time happen in this order.
        moments: what their times count from.
        step_s: of the plant.
    """

    __slots__ = ("_earliest_step", "_events", "_moments", "_step_s", "next_step")

    def __init__(self, events: Sequence[_Event], moments: Moments, step_s: float) -> None:
        self._events = list(events)
        self._moments = moments
        self._step_s = step_s
        self._earliest_step = 0
        self.next_step = -1
        """The step at which the next one happens; -1: none that is known of."""
        self._look_ahead()

    def take(self) -> _Event:
        """The event of `next_step`, which is over with it."""
        event = self._events.pop(0)
        self._look_ahead()
        return event

    def moments_known(self, earliest_step: int) -> None:
        """A moment is known now: what counts from it has its time, from the next step on."""
        self._earliest_step = earliest_step
        self._look_ahead()

    def _look_ahead(self) -> None:
        self._events.sort(key=self._moments.time_s)
        time_s = self._moments.time_s(self._events[0]) if self._events else float("inf")
        if not isfinite(time_s):
            self.next_step = -1
            return
        # A time on the grid is that step, whatever rounding makes of the quotient.
        self.next_step = max(self._earliest_step, ceil(time_s / self._step_s - 1e-6))
