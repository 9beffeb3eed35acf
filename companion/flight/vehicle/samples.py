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
_LATE_S = 1.0
"""A sample that is older than the newest by less was overtaken; by more, the clock was set back."""


class Samples:
    """Makes samples of the state messages of one vehicle.

    A state that stays as it is to the last bit while its stamps go on is not measured any more:
    in the air no estimate stands still.
    """

    __slots__ = (
        "_changed_s",
        "_reader",
        "_sampled_s",
        "count",
        "frozen_after_s",
        "in_air",
        "lost",
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
        self.frozen_after_s = 0.1
        """Position and velocity that have not changed for longer are frozen, in the air."""
        self.in_air: Callable[[], bool] = lambda: False
        """Whether the vehicle says that it flies; on the ground an estimate may stand still."""
        self.lost: Callable[[], bool] = lambda: False
        """Whether the estimator says that it has lost its position: what it goes on to tell is
        reckoned, and drifts."""
        self._changed_s = -math.inf
        """Stamp of the sample at which position or velocity changed last."""
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
        newest = self.newest
        if clock.valid:
            about_s = clock.autopilot_time(received_s)
        else:
            about_s = 0.0 if newest is None else newest.time_s
        sample = self._reader.take(frame, about_s)
        if sample is None:
            return
        if isinstance(sample, Rejected):
            self.rejected += 1
            self.rejected_because = sample.reason
            return
        behind_s = 0.0 if newest is None else newest.time_s - sample.time_s
        unusable = ""
        if self.lost():
            unusable = "the autopilot's estimator says that it has lost its position"
        elif self._frozen(sample):
            unusable = "position and velocity are frozen while their stamps go on"
        if unusable:
            self.rejected += 1
            self.rejected_because = unusable
            return
        self.rejected_because = ""
        self.count += 1
        if newest is None or not 0.0 <= behind_s < _LATE_S:
            self.newest = sample
            self._sampled_s = received_s
        if self.on_sample is not None:
            self.on_sample(sample, received_s)

    def _frozen(self, sample: VehicleState) -> bool:
        newest = self.newest
        if (
            newest is None
            or sample.position_enu_m != newest.position_enu_m
            or sample.velocity_enu_m_s != newest.velocity_enu_m_s
            or not self.in_air()
        ):
            self._changed_s = sample.time_s
            return False
        return sample.time_s - self._changed_s > self.frozen_after_s

    def forget(self) -> None:
        """The autopilot has restarted: its time has begun anew."""
        self.newest = None
        self.rejected_because = ""
        self._sampled_s = -math.inf
        self._reader.forget()
