"""What all exchanges with an autopilot have in common: a verdict, and when to repeat."""

import math
from dataclasses import dataclass
from enum import Enum

from companion.mavlink.commands import Ack, Command


class Verdict(Enum):
    """How an exchange stands."""

    PENDING = "pending"
    ACCEPTED = "accepted"
    REFUSED = "refused"
    TIMED_OUT = "timed out"


@dataclass(frozen=True, slots=True)
class Patience:
    """How long to wait for an answer and how often to ask."""

    timeout_s: float = 0.5
    """Wait for an answer to one request."""
    attempts: int = 4
    """Requests in all."""
    in_progress_timeout_s: float = 5.0
    """Wait for the next word after the autopilot has said that it is at it."""


class Attempts:
    """Counts requests and knows when the next is due."""

    __slots__ = ("_due_s", "asked_s", "made", "patience")

    def __init__(self, patience: Patience) -> None:
        self.patience = patience
        self.made = 0
        self.asked_s = -math.inf
        """When the last request was made."""
        self._due_s = -math.inf

    @property
    def due_s(self) -> float:
        """When to ask again, or to give up (loop time)."""
        return self._due_s

    def is_due(self, now_s: float) -> bool:
        """True if the answer is late, or nothing has been asked yet."""
        return now_s >= self._due_s

    @property
    def exhausted(self) -> bool:
        """True if all requests have been made."""
        return self.made >= self.patience.attempts

    def note_request(self, now_s: float) -> None:
        """Count a request and wait for its answer."""
        self.made += 1
        self.asked_s = now_s
        self._due_s = now_s + self.patience.timeout_s

    def answered_by(self, ack: Ack, command: Command) -> bool:
        """True if an acknowledgement may be one of these requests' for the command."""
        return self.made > 0 and ack.command_id == command.command_id

    def wait(self, until_s: float) -> None:
        """Wait for something until then, instead of asking again."""
        self._due_s = until_s
