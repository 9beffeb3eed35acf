"""A flight from connecting to landing: which stage follows which, whatever happens.

Before the vehicle is armed whatever is wrong refuses the flight; from then on it aborts it, and the
vehicle is landed or left to the autopilot's own failsafe.
"""

import asyncio
from dataclasses import dataclass
from enum import Enum

from companion.flight.errors import (
    DisarmedError,
    FlightAbortedError,
    HandedOverError,
    LandingAskedError,
    LinkLostError,
)
from companion.flight.inbox import PilotCommand
from companion.flight.stages.crew import Flight, FlightScope
from companion.flight.stages.ending import FlightOverError, land, wait_for_word
from companion.flight.stages.leaving import leave
from companion.flight.stages.preparation import arm_vehicle, prepare
from companion.flight.stages.tracking import engage, take_off, track


@dataclass(frozen=True, slots=True)
class Ending:
    """How a flight that left the ground ended."""

    landed: bool
    """The vehicle is on the ground and disarmed, by the companion's landing."""
    tracked: bool
    """It ended in the air, as was asked for, with all that is scored flown."""
    completed: bool
    """The trajectory was flown to its end."""
    note: str
    """One sentence for a person; empty if all went as planned."""


class _Stage(Enum):
    TAKE_OFF = "take off"
    FLY = "fly"
    LAND = "land"


async def fly(flight: Flight) -> Ending:
    """Fly the mission from connecting to landing, or what the flight's scope is of it.

    Raises:
        FlightRefusedError: nothing was armed.
        FlightAbortedError: the flight ended otherwise than by landing; the text says how.
    """
    flight.inbox.on_put = flight.authority.on_command
    patient = True
    try:
        await prepare(flight)
        if flight.scope is FlightScope.WHOLE:
            standing = flight.connection.state
            assert standing is not None
            flight.progress.ground_up_m = standing.position_enu_m[2]
            try:
                await arm_vehicle(flight)
            except BaseException:
                flight.stream.stop()  # an idle one may flow, for a vehicle to be armed in its mode
                raise
        return await _fly_armed(flight)
    except asyncio.CancelledError:
        patient = False
        raise
    finally:
        await leave(flight, patient=patient)
        if flight.inspector is not None:
            flight.authority.rest()
            await flight.inspector.after_flight()


async def _fly_armed(flight: Flight) -> Ending:
    """From armed to disarmed; every way out of here ends on the ground or with the autopilot.

    But a flight that was to begin in the air ends there.
    """
    in_air = flight.scope is FlightScope.AIRBORNE
    stage = _Stage.FLY if in_air else _Stage.TAKE_OFF
    note = ""
    trouble: FlightAbortedError | None = None
    while True:
        try:
            if stage is _Stage.TAKE_OFF:
                await take_off(flight)
                stage = _Stage.FLY
            if stage is _Stage.FLY:
                await track(flight, await engage(flight))
                if in_air:
                    return Ending(False, True, flight.progress.completed, "")
                stage = _Stage.LAND
            await land(flight)
            break
        except LandingAskedError:
            note = "landed early by command"
            stage = _Stage.LAND
        except HandedOverError as handed:
            flight.stream.stop()
            try:
                word = await wait_for_word(flight, str(handed))
            except FlightOverError as over:
                return _ended(flight, False, str(over), trouble)
            note = "" if word is PilotCommand.RESUME else "landed early by command"
            stage = _Stage.FLY if word is PilotCommand.RESUME else _Stage.LAND
        except (LinkLostError, DisarmedError):
            flight.stream.stop()
            raise
        except FlightAbortedError as error:
            if stage is _Stage.LAND or flight.connection.waiting.failure is not None:
                flight.stream.stop()
                raise
            flight.voice.tell("error", str(error))
            trouble = error
            stage = _Stage.LAND
    return _ended(flight, True, note, trouble)


def _ended(flight: Flight, landed: bool, note: str, trouble: FlightAbortedError | None) -> Ending:
    """The ending, unless something had gone wrong before the landing."""
    if trouble is not None:
        raise FlightAbortedError(f"{trouble} {'The vehicle was landed.' if landed else note}")
    return Ending(landed, False, flight.progress.completed, note)
