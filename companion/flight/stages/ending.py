"""How a flight comes down: landing by the autopilot, or waiting after a hand-over."""

from companion.flight.errors import FlightAbortedError, HandedOverError
from companion.flight.inbox import PilotCommand
from companion.flight.stages.crew import Flight
from companion.flight.stages.leaving import leave
from companion.flight.stages.tracking import outside_geofence
from companion.flight.vehicle.reports import LANDED_ON_GROUND
from companion.mavlink.commands import disarm
from companion.mavlink.exchange import Verdict


class FlightOverError(Exception):
    """The flight ends after a hand-over, with the vehicle left to the autopilot or down."""


async def land(flight: Flight) -> None:
    """Land by the autopilot; the stream runs until the mode is confirmed.

    Raises:
        HandedOverError: the autopilot does not land, or somebody else has taken over.
        FlightAbortedError: it did not disarm in time.
    """
    connection, stream = flight.connection, flight.stream
    flight.authority.expect_landing(connection.mode, "land")
    flight.voice.phase("land", "by the autopilot")
    if not connection.reports.armed:
        stream.stop()
        return
    if connection.reports.landed_state == LANDED_ON_GROUND:
        stream.stop()
        exchange = await connection.exchanges.command(disarm(connection.target))
        if exchange.verdict is Verdict.ACCEPTED:
            await _wait_disarmed(flight)
            return
    change = await flight.backend.land()
    if change.verdict is not Verdict.ACCEPTED:
        stream.hand_over(change.explanation)
        raise HandedOverError(change.explanation)
    stream.stop()
    connection.health.standby()
    flight.authority.expect_landing("land")
    await _wait_disarmed(flight)


async def wait_for_word(flight: Flight, reason: str) -> PilotCommand:
    """After a hand-over: only a person's word, or the ground, ends this.

    Returns:
        RESUME or LAND.

    Raises:
        FlightOverError: the autopilot has landed, nobody said a word, or an abort was confirmed.
    """
    connection, voice = flight.connection, flight.voice
    wait_s = flight.mission.timeouts.handed_over_s
    restarts = connection.restarts
    flight.authority.leave_to_others()
    voice.phase("handed over", reason)
    voice.tell(
        "warning",
        f"handed over: {reason}. `companion resume` flies on, `companion land` lands; "
        "Ctrl-C leaves it to who flies it; else the autopilot flies",
    )
    await flight.stream.handing_over.finished()
    word: PilotCommand | None = None

    def spoken() -> bool:
        nonlocal word
        while word is None and flight.inbox.waiting:
            word = flight.inbox.take()
            problem = not_to_be_resumed() if word is PilotCommand.RESUME else ""
            if problem:
                voice.tell("warning", f"not resumed: {problem}")
                word = None
        return word is not None or not connection.reports.armed

    def not_to_be_resumed() -> str:
        if connection.reports.landed_state == LANDED_ON_GROUND:
            return "the vehicle is on the ground"
        return outside_geofence(flight)

    try:
        await connection.waiting.until(
            spoken,
            connection.loop_seconds(wait_s),
            lambda: f"nobody resumed within {wait_s:g} s",
        )
    except FlightAbortedError as error:
        if connection.waiting.failure is not None:
            raise
        remark = await leave(flight)
        raise FlightOverError(f"{reason}; {error}: {_left(flight, remark)}") from error
    if word is None and connection.restarts > restarts:
        raise FlightOverError(f"{reason}; the autopilot restarted in flight")
    if word is None:
        raise FlightOverError(f"{reason}; the autopilot has landed and disarmed the vehicle")
    if word in (PilotCommand.ABORT, PilotCommand.END):
        remark = await leave(flight)
        raise FlightOverError(f"{reason}; aborted by command, {_left(flight, remark)}")
    return word


def _left(flight: Flight, remark: str) -> str:
    """How the vehicle is left, for a person."""
    connection = flight.connection
    left = "the vehicle is disarmed"
    if connection.reports.armed:
        left = f"the vehicle is left to the autopilot, in mode {connection.mode}"
    return f"{left}; {remark}" if remark else left


async def _wait_disarmed(flight: Flight) -> None:
    connection = flight.connection
    wait_s = flight.mission.timeouts.land_s
    await connection.waiting.until(
        lambda: not connection.reports.armed,
        connection.loop_seconds(wait_s),
        lambda: (
            f"The vehicle did not disarm within {wait_s:g} s of landing; it is left to the "
            f"autopilot, in mode {connection.mode}."
        ),
    )
