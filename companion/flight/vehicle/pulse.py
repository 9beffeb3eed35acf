"""Signs of life of the vehicle: its heartbeats, and its answers to our questions for its time.

A heartbeat is the only message that says whether it is armed.  An autopilot whose other messages go
on while its heartbeats do not has been told to stop them, or its link drops just these.  The
companion would fly on, blind to a disarming and to a landing.

One that is heard and answers nothing does not hear the companion: setpoints do not arrive either.
PX4's failsafe then acts and says so; ArduPilot flies the last target on, and says nothing.
"""

import math
from collections.abc import Callable

from companion.flight.vehicle.losses import Losses
from companion.mavlink.timesync import INTERVAL_S, ClockEstimator

MISSING_S = 3.5
"""Three in a row, and half a second for the last to be late; by the autopilot's clock."""
_LATE_S = 0.5
_BY_CHANCE = 1.0e-5
"""On a link that loses packets more are awaited: all may be lost by chance with this probability
alone."""
UNHEARD_S = 1.0
"""Unanswered for so long: by our clock, by which the questions are asked."""
_FEWEST_QUESTIONS = 4
_UNHEARD_BY_CHANCE = 1.0e-6
_STEADY_S = 0.3
"""After a longer silence what was asked meanwhile proves nothing."""
_PAUSE_S = 1.0
"""A silence this long is the link's: from its end on heartbeats are missed anew."""


class Pulse:
    """Notes when heartbeats and other messages come, and judges what does not.

    Args:
        loop_seconds: makes the loop's seconds of the autopilot's.
        losses: of the vehicle's packets.
    """

    __slots__ = ("_heard_s", "_loop_seconds", "_losses", "_since_s", "_steady_since_s")

    def __init__(self, loop_seconds: Callable[[float], float], losses: Losses) -> None:
        self._loop_seconds = loop_seconds
        self._losses = losses
        self._heard_s = -math.inf
        self._since_s = math.inf
        """The last heartbeat, or when the vehicle was heard again after a silence."""
        self._steady_since_s = math.inf

    def on_message(self, now_s: float) -> None:
        """Anything has come from the vehicle, at the loop's time."""
        if now_s - self._heard_s > _STEADY_S:
            self._steady_since_s = now_s
            if now_s - self._heard_s > self._loop_seconds(_PAUSE_S):
                self._since_s = now_s
        self._heard_s = now_s

    def on_heartbeat(self, now_s: float) -> None:
        """A heartbeat has come from it."""
        self.on_message(now_s)
        self._since_s = now_s

    def forget(self) -> None:
        """The autopilot has restarted."""
        self._heard_s, self._since_s, self._steady_since_s = -math.inf, math.inf, math.inf

    @property
    def missing_after_s(self) -> float:
        """After so long without a heartbeat they have stopped, s of the autopilot's clock."""
        return max(MISSING_S, self._losses.packets_in_a_row(_BY_CHANCE) + _LATE_S)

    def missing(self, now_s: float) -> bool:
        """True if other messages come, and heartbeats have not for `missing_after_s`."""
        late_s = now_s - self._since_s
        # It is asked at every frame: what can't be too late is not judged.
        if late_s <= self._loop_seconds(MISSING_S):
            return False
        if now_s - self._heard_s > self._loop_seconds(_PAUSE_S):
            return False
        return late_s > self._loop_seconds(self.missing_after_s)

    def unheard_for_s(self, now_s: float, clock: ClockEstimator) -> float:
        """For how long it has been heard and answered nothing, s of our clock; 0 if it answers.

        Args:
            now_s: our clock's.
            clock: that asks.
        """
        if now_s - self._heard_s > _STEADY_S:
            return 0.0
        unheard_s = now_s - clock.unanswered_since(self._steady_since_s)
        return unheard_s if unheard_s > 0.0 else 0.0

    @property
    def unheard_after_s(self) -> float:
        """After so long without an answer it does not hear us, s of our clock."""
        questions = self._losses.answers_in_a_row(_UNHEARD_BY_CHANCE)
        return max(UNHEARD_S, max(_FEWEST_QUESTIONS, questions) * INTERVAL_S)
