"""Ctrl-C while flying: lands; once more hands over; SIGTERM lands.

After a hand-over any of them leaves the vehicle to who flies it: who ends a program, or the system
that shuts down, does not ask for a landing under the pilot.
"""

import asyncio
import contextlib
import signal
from collections.abc import Iterator

from companion.flight.inbox import Inbox, PilotCommand
from companion.flight.observer import Observer


@contextlib.contextmanager
def commands_by_signal(inbox: Inbox, observer: Observer) -> Iterator[None]:
    """Put commands into the inbox when signals come, instead of breaking off.

    Only the main thread can; elsewhere signals do what they did before.
    """
    loop = asyncio.get_running_loop()

    def on_interrupt() -> None:
        if inbox.interrupts == 0:
            observer.message(
                "warning",
                "Ctrl-C: landing if the companion flies, else leaving the vehicle to who does. "
                "Once more hands over to the autopilot.",
            )
            inbox.put(PilotCommand.END)
        else:
            inbox.put(PilotCommand.ABORT)
        inbox.interrupts += 1

    try:
        loop.add_signal_handler(signal.SIGINT, on_interrupt)
        loop.add_signal_handler(signal.SIGTERM, inbox.put, PilotCommand.END)
    except (ValueError, RuntimeError):
        yield
        return
    try:
        yield
    finally:
        loop.remove_signal_handler(signal.SIGINT)
        loop.remove_signal_handler(signal.SIGTERM)
