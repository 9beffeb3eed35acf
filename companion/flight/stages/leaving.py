"""Going from a vehicle that is still armed: nothing of ours may act on it once we are gone.

ArduPilot's failsafe for a lost ground station watches our heartbeat where `--fix`, or the vehicle's
owner, has set it so.  It acts in every mode: five seconds after the companion's end it would land
the vehicle under a pilot who has taken it over.
"""

from collections.abc import Callable

from companion.flight.check.inspector import Inspector
from companion.flight.errors import FlightAbortedError
from companion.flight.inbox import PilotCommand
from companion.flight.stages.crew import Flight

_RETRY_S = 5.0


async def leave(flight: Flight, *, patient: bool = True) -> str:
    """See to it that the autopilot does not miss us; of no effect once the vehicle is disarmed.

    What of the heartbeat's failsafe was set for the flight is set back.  Where that cannot be
    confirmed our heartbeat goes on, until it can be, the vehicle is disarmed, the link is lost, or
    a person says enough.

    Args:
        flight: that is over, for the companion.
        patient: stay with a heartbeat that is missed; else only set back.

    Returns:
        What is to be said of the flight's end besides; empty if there is nothing.
    """
    connection, inspector = flight.connection, flight.inspector
    waiting = connection.waiting
    if inspector is None or inspector.let_go:
        return ""
    if not connection.reports.armed or waiting.vehicle_is_gone:
        return ""
    # First: a vehicle that has been left to others is not given to anybody.
    flight.stream.hand_over("the flight has ended")
    flight.authority.leave_to_others()
    await flight.stream.handing_over.finished()
    try:
        with waiting.despite_failure():
            remark = await _release(flight, inspector, patient=patient)
    except FlightAbortedError as error:
        return str(error).rstrip(".")
    inspector.let_go = connection.reports.armed
    return remark


async def _release(flight: Flight, inspector: Inspector, *, patient: bool) -> str:
    """Set back, and stay while that is not enough.

    Raises:
        FlightAbortedError: the link was lost.
    """
    connection, waiting = flight.connection, flight.connection.waiting
    tell = _once(flight.voice.tell)
    enough = False

    def over() -> bool:
        nonlocal enough
        while not enough and flight.inbox.waiting:
            word = flight.inbox.take()
            enough = word is PilotCommand.ABORT
            if word is not None and not enough:
                flight.voice.tell("warning", f"not obeyed ({word.value}): the flight is over")
        return enough or not connection.reports.armed

    problems = await inspector.release_heartbeat(tell)
    if not problems:
        return ""
    if not patient:
        return " ".join(problems)
    flight.voice.tell(
        "error",
        "the companion's heartbeat goes on until the vehicle is disarmed, else a failsafe would "
        "act under whoever flies; `companion abort`, or Ctrl-C twice, ends that. "
        + " ".join(problems),
    )
    while problems:
        try:
            await waiting.until(over, connection.loop_seconds(_RETRY_S), lambda: "")
        except FlightAbortedError:
            if waiting.failure is not None:
                raise
            problems = await inspector.release_heartbeat(tell)
        else:
            break
    if not problems:
        return ""
    if not connection.reports.armed:
        return "the companion's heartbeat went on until it was disarmed"
    flight.voice.tell("warning", f"the heartbeat ends by command: {' '.join(problems)}")
    return f"the heartbeat ended by command: {' '.join(problems)}".rstrip(".")


def _once(tell: Callable[[str, str], None]) -> Callable[[str, str], None]:
    """Tells each text once: what is tried again meets the same."""
    told: dict[str, None] = {}

    def tell_new(severity: str, text: str) -> None:
        if text not in told:
            told[text] = None
            tell(severity, text)

    return tell_new
