"""Ctrl-C while flying: lands; once more hands over; SIGTERM and a lost terminal land.

A terminal is lost when its window is closed or the network under it fails; a flight that shall
outlive it is begun with `nohup`, and is then not bothered.

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

    Only the main thread can; elsewhere signals do what they did before.  Afterwards they do so
    again.
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

    def on_end(number: signal.Signals) -> None:
        inbox.ended_by = number
        inbox.put(PilotCommand.END)

    ends = [signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        ends.append(signal.SIGHUP)
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, *ends)}
    try:
        loop.add_signal_handler(signal.SIGINT, on_interrupt)
        for number in ends:
            loop.add_signal_handler(number, on_end, number)
    except (ValueError, RuntimeError):
        yield
        return
    try:
        yield
    finally:
        for number, handler in before.items():
            loop.remove_signal_handler(number)
            if handler is not None:  # one that was not set from Python can't be set back
                signal.signal(number, handler)
