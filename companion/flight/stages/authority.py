"""Who flies: the companion, until a person says otherwise or somebody else takes over."""

import asyncio
import math
from collections.abc import Callable

from companion.flight.errors import DisarmedError, HandedOverError, LandingAskedError
from companion.flight.inbox import Inbox, PilotCommand
from companion.flight.loop_time import loop_time
from companion.flight.setpoints.setpoint_stream import SetpointStream
from companion.flight.vehicle.connection import Connection
from companion.flight.vehicle.reports import LANDED_ON_GROUND
from companion.flight.voice import Voice

_ABORTED = "aborted by command"


class Authority:
    """Ends what the flight waits for when the vehicle is no longer the companion's to fly.

    Each stage says which modes it may see.  Another one means that somebody else has chosen it, a
    person or the autopilot's failsafe: the setpoint stream stops at once, what was being asked for
    is dropped, and nothing is sent to fight it.
    """

    def __init__(
        self, connection: Connection, stream: SetpointStream, inbox: Inbox, voice: Voice
    ) -> None:
        self._connection = connection
        self._stream = stream
        self._inbox = inbox
        self._voice = voice
        self._modes: tuple[str, ...] = ()
        self._streaming = False
        self._landing = False
        self._restarts = 0
        self._clocks_set_back = 0
        self._time = loop_time
        self._in_touch_s = math.nan
        """Loop's time at which nothing was found amiss last."""
        self.fault: Callable[[], Exception | None] = lambda: None
        """What else ends a flight by a landing; None while all is well."""
        self.handed_over = False
        """True while somebody else flies: a person, or the autopilot's failsafe."""

    def on_command(self, command: PilotCommand) -> None:
        """A command has come: an abort takes effect at once, whatever the flight does."""
        if command is PilotCommand.ABORT:
            self._stream.hand_over(_ABORTED)
        self._connection.waiting.wake()

    def expect(self, *modes: str, streaming: bool = False) -> None:
        """In flight: these modes are ours, and setpoints flow if `streaming`."""
        self._modes = modes
        self.handed_over = False
        self._stream.handing_over.ours = True
        self._streaming = streaming
        self._restarts = self._connection.restarts
        self._clocks_set_back = self._connection.clocks_set_back
        self._landing = False
        self._time = asyncio.get_running_loop().time
        self._in_touch_s = math.nan
        self._connection.waiting.interruption = self._interruption

    def expect_landing(self, *modes: str) -> None:
        """While landing, disarming is the aim, and the ground ends the mode."""
        self.expect(*modes)
        self._landing = True

    def rest(self) -> None:
        """Nothing but a failure ends a wait."""
        self._connection.waiting.interruption = lambda: None

    def leave_to_others(self) -> None:
        """The companion flies no more, until it expects a mode again."""
        self.rest()
        self.handed_over = True
        self._stream.handing_over.ours = False

    def _interruption(self) -> Exception | None:
        stream, connection = self._stream, self._connection
        reports = connection.reports
        if not reports.armed and not self._landing:
            stream.stop("disarmed")
            if connection.restarts > self._restarts:
                return DisarmedError(
                    "The autopilot restarted in flight: its time since boot began anew. Nothing "
                    "that the companion could send would help."
                )
            return DisarmedError(
                f"The vehicle was disarmed, in mode {connection.mode}, and not by the companion."
            )
        on_ground = self._landing and reports.landed_state == LANDED_ON_GROUND
        if reports.armed and not on_ground and connection.mode not in self._modes:
            reason = (
                f"somebody else changed the mode to {connection.mode} "
                "(a person, or the autopilot's failsafe)"
            )
            stream.stop(reason)
            return HandedOverError(reason)
        astray = self._astray()
        if astray:
            stream.hand_over(astray)
            return HandedOverError(astray)
        command = self._inbox.take()
        if command is PilotCommand.ABORT:
            return HandedOverError(f"{_ABORTED}: {self._after_abort()}")
        if self._streaming and not stream.running:
            return HandedOverError(stream.stopped_because)
        if command in (PilotCommand.LAND, PilotCommand.END):
            if not self._landing:
                return LandingAskedError()
            self._voice.tell("info", "landing already")
        elif command is PilotCommand.RESUME:
            self._voice.tell("info", "nothing to resume: the companion flies")
        return None if self._landing else self.fault()

    def _astray(self) -> str:
        """Why the flight cannot go on, though the vehicle is where it should be; empty if it can.

        What only the passing of time brings about is looked at once at a time: the packets that
        come at one moment can only better it.
        """
        connection = self._connection
        if self._streaming and connection.clocks_set_back > self._clocks_set_back:
            return "the autopilot's clock was set back: its times mean nothing any more"
        now_s = self._time()
        if now_s == self._in_touch_s:
            return ""
        amiss = connection.blind_because or (connection.unheard_because if self._streaming else "")
        if not amiss:
            self._in_touch_s = now_s
        return amiss

    def _after_abort(self) -> str:
        """What the vehicle does now, for a person."""
        if self._stream.stopped_because == _ABORTED:
            return self._connection.dialect.hand_over.explanation
        return f"the autopilot goes on in mode {self._connection.mode}"
