"""The vehicle's state as it arrives: samples that can be flown on, and those that cannot."""

import math
from collections.abc import Callable

from companion.mavlink.framing import Frame
from companion.mavlink.state_source import StateReader, StateSource
from companion.mavlink.telemetry import Rejected
from companion.mavlink.timesync import ClockEstimator
from companion.vehicle_state import VehicleState

_ARRIVES_S = 1.0
"""The state counts as arriving for so long after a sample."""


class Samples:
    """Makes samples of the state messages of one vehicle."""

    __slots__ = (
        "_reader",
        "_sampled_s",
        "count",
        "newest",
        "on_sample",
        "rejected",
        "rejected_because",
    )

    def __init__(self) -> None:
        self.newest: VehicleState | None = None
        """Of this boot of the autopilot; None before the first."""
        self.count = 0
        """Usable ones so far."""
        self.rejected = 0
        self.rejected_because = ""
        """What was wrong with the last one that came; empty if it was usable."""
        self.on_sample: Callable[[VehicleState, float], None] | None = None
        """Called with each usable one and the loop's time at which it came; must not raise."""
        self._reader = StateReader()
        self._sampled_s = -math.inf

    @property
    def source(self) -> StateSource:
        """What they are made of."""
        return self._reader.source

    def make_of(self, source: StateSource) -> None:
        """Make them of this from now on; those before count no more."""
        if source is not self._reader.source:
            self._reader.source = source
            self.newest = None
            self.rejected_because = ""

    def arriving(self, now_s: float) -> bool:
        """True if the newest usable one came not long ago, by the loop's time."""
        return now_s - self._sampled_s <= _ARRIVES_S

    def take(self, frame: Frame, received_s: float, clock: ClockEstimator) -> None:
        """Take one of the vehicle's `STATE_MESSAGES`.

        Args:
            frame: the message.
            received_s: the loop's time at which it came.
            clock: gives the autopilot's time about then, by which its stamps are judged.
        """
        if clock.valid:
            about_s = clock.autopilot_time(received_s)
        else:
            about_s = 0.0 if self.newest is None else self.newest.time_s
        sample = self._reader.take(frame, about_s)
        if sample is None:
            return
        if isinstance(sample, Rejected):
            self.rejected += 1
            self.rejected_because = sample.reason
            return
        self.rejected_because = ""
        self.count += 1
        self.newest = sample
        self._sampled_s = received_s
        if self.on_sample is not None:
            self.on_sample(sample, received_s)

    def forget(self) -> None:
        """The autopilot has restarted: its time has begun anew."""
        self.newest = None
        self.rejected_because = ""
        self._sampled_s = -math.inf
        self._reader.forget()
