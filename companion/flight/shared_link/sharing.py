"""The link beside the flight: what is told about it, and who else uses it."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from functools import partial

from companion.flight.errors import FlightAbortedError, FlightRefusedError
from companion.flight.inbox import PilotCommand
from companion.flight.shared_link.forwarding import Forwarder
from companion.flight.stages.crew import Flight
from companion.mavlink.peers import Vehicle


def watch_link(flight: Flight) -> None:
    """Tell a person when the link is lost or back, and which other vehicles are on it."""
    connection, voice, link = flight.connection, flight.voice, flight.mission.link
    connection.peers.wanted_component_id = link.component_id
    was_down = False

    def on_change(down_because: str) -> None:
        nonlocal was_down
        if down_because:
            voice.tell("warning", f"the link is down: {down_because}; trying again")
        elif was_down:
            voice.tell("info", "the link is there again")
        was_down = bool(down_because)

    def on_other(other: Vehicle) -> None:
        chosen = connection.peers.vehicle
        what = f"system {other.system_id} component {other.component_id} is on the link, too"
        if chosen is None:
            wanted = f"system {link.system_id or 'any'} component {link.component_id or 'any'}"
            voice.tell("warning", f"{what}, and is not what was asked for: {wanted}")
        else:
            voice.tell(
                "warning",
                f"{what}; the companion flies system {chosen.system_id} component "
                f"{chosen.component_id} (link.system_id and link.component_id choose)",
            )

    connection.on_link_change = on_change
    connection.on_other_vehicle = on_other
    connection.reception.on_flood = partial(voice.tell, "warning")


@contextlib.asynccontextmanager
async def shared_link(flight: Flight) -> AsyncIterator[None]:
    """Forward while a flight runs, and after it for as long as a pilot needs the link.

    Args:
        flight: whose link it is.

    Raises:
        LinkError: an endpoint cannot be opened.
    """
    try:
        async with _forwarded(flight):
            yield
    finally:
        reception = flight.connection.reception
        if reception.flood_remark:
            severity = "warning" if reception.flooded else "info"
            flight.voice.tell(severity, reception.flood_remark)


@contextlib.asynccontextmanager
async def _forwarded(flight: Flight) -> AsyncIterator[None]:
    """Forward, if there is anybody to forward to.

    Args:
        flight: whose link it is.

    Raises:
        LinkError: an endpoint cannot be opened.
    """
    endpoints = (*flight.mission.link.forward, *flight.backend.endpoints)
    if not endpoints:
        yield
        return
    over = False
    forwarder = Forwarder(
        flight.connection,
        endpoints,
        flight.voice.tell,
        lambda: over or flight.authority.handed_over,
        partial(hand_over_for_a_pause, flight),
    )
    await forwarder.open()
    if flight.backend.endpoints:
        flight.backend.attach(forwarder.endpoints[-1])
    try:
        yield
    except (asyncio.CancelledError, FlightRefusedError):
        raise  # nothing of ours is in the air
    except BaseException:
        over = True
        await _stay_for_the_pilot(flight, forwarder)
        raise
    else:
        over = True
        await _stay_for_the_pilot(flight, forwarder)
    finally:
        await flight.backend.close()
        forwarder.close()
        refused = ", ".join(f"{count} {what}" for what, count in sorted(forwarder.refused.items()))
        flight.voice.tell(
            "info",
            f"the link was shared: {forwarder.passed} messages of clients passed on, kept back: "
            f"{refused or 'none'}; {forwarder.unsent} not taken by clients",
        )


def hand_over_for_a_pause(flight: Flight) -> bool:
    """Hand over because a ground station wants a pause; False if nothing of ours is in the air."""
    stream = flight.stream
    if not (stream.running or stream.handing_over.possible):
        return False
    stream.hand_over("a ground station asked for a pause")
    flight.voice.tell("warning", "a ground station asked for a pause: handing over")
    flight.connection.waiting.wake()
    return True


async def _stay_for_the_pilot(flight: Flight, forwarder: Forwarder) -> None:
    """Go on forwarding while the vehicle is armed: a ground station may fly it over this link."""
    connection, stream = flight.connection, flight.stream
    stream.hand_over("the flight has ended")
    await stream.handing_over.finished()
    if connection.waiting.failure is not None or not connection.reports.armed:
        return
    if not forwarder.has_talkers:
        return
    flight.authority.leave_to_others()
    flight.voice.tell(
        "warning",
        "the vehicle is armed: the link stays shared with the ground station until it is "
        "disarmed. `companion abort`, or Ctrl-C, ends that",
    )

    def enough() -> bool:
        word = flight.inbox.take()
        return word in (PilotCommand.ABORT, PilotCommand.END) or not connection.reports.armed

    with contextlib.suppress(FlightAbortedError):
        await connection.waiting.until(enough, None, lambda: "")
