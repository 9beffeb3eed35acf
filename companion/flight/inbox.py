"""The one inbox of a flight: commands of a person, from wherever they come."""

import asyncio
from collections import deque
from enum import Enum


class PilotCommand(Enum):
    """What a person may ask of a running flight."""

    LAND = "land"
    ABORT = "abort"
    RESUME = "resume"


class Inbox:
    """Commands in the order in which they came."""

    def __init__(self) -> None:
        self._waiting: deque[PilotCommand] = deque()
        self._arrived = asyncio.Event()

    def put(self, command: PilotCommand) -> None:
        """Ask for something; takes effect at the flight's next step."""
        self._waiting.append(command)
        self._arrived.set()

    def take(self) -> PilotCommand | None:
        """The oldest command that waits, or None."""
        if not self._waiting:
            return None
        command = self._waiting.popleft()
        if not self._waiting:
            self._arrived.clear()
        return command

    def peek(self) -> PilotCommand | None:
        """The oldest command, left where it is."""
        return self._waiting[0] if self._waiting else None
