"""The one inbox of a flight: commands of a person, from wherever they come."""

import signal
from collections import deque
from collections.abc import Callable
from enum import Enum


class PilotCommand(Enum):
    """What a person may ask of a running flight."""

    LAND = "land"
    """Land where the vehicle is, by the autopilot's own landing."""
    ABORT = "abort"
    """Stop commanding at once and leave the vehicle to the autopilot's failsafe."""
    END = "end"
    """What a signal asks for: land if the companion flies; leave the vehicle to who else does."""
    RESUME = "resume"
    """Take control again after a hand-over or a takeover, and fly the trajectory anew."""


class Inbox:
    """Commands in the order in which they came."""

    def __init__(self) -> None:
        self._waiting: deque[PilotCommand] = deque()
        self.interrupts = 0
        """How often a person has pressed Ctrl-C."""
        self.ended_by: signal.Signals | None = None
        """SIGTERM or SIGHUP, if one of them came."""
        self.on_put: Callable[[PilotCommand], None] | None = None
        """Called when a command has come; the flight wakes up by it."""

    def put(self, command: PilotCommand) -> None:
        """Ask for something."""
        self._waiting.append(command)
        if self.on_put is not None:
            self.on_put(command)

    @property
    def waiting(self) -> bool:
        """True if a command has not been taken yet."""
        return bool(self._waiting)

    def take(self) -> PilotCommand | None:
        """The oldest command that waits, or None."""
        return self._waiting.popleft() if self._waiting else None
