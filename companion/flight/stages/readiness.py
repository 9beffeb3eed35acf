"""Waiting until the autopilot would arm, and saying what it waits for."""

import asyncio

from companion.flight.errors import FlightAbortedError
from companion.flight.stages.before_arming import ModeKeeper
from companion.flight.stages.crew import Flight, FlightScope
from companion.flight.stages.ground_stream import OnlyTheMode, stand_in_setpoint_mode
from companion.flight.vehicle.connection import Connection
from companion.mavlink.exchange import Verdict
from companion.mavlink.messages import MessageId

_BETWEEN_REQUESTS_S = 1.0
_SILENT_S = 5.0
"""Reports that come five times a second have stopped by then: the autopilot was restarted, or
somebody else has set the interval."""
_HEARD_S = 2.0
"""Its HEARTBEAT comes once a second; a link that is silent as a whole is another matter."""
_QUIET_AT_FIRST_S = 1.0
_QUIET_S = 3.0


class Progress:
    """Decides when a person is told what is waited for: at a change, and not too often."""

    def __init__(self, begun_s: float) -> None:
        """Begin at the loop's time `begun_s`."""
        self._told: tuple[str, ...] = ()
        self._due_s = begun_s + _QUIET_AT_FIRST_S

    def news(self, missing: tuple[str, ...], now_s: float) -> str | None:
        """What to tell now, or None."""
        if not missing or missing == self._told or now_s < self._due_s:
            return None
        self._told = missing
        self._due_s = now_s + _QUIET_S
        return f"waiting for: {', '.join(missing)}"


class _Reports:
    """Do the reports still come that readiness is judged by?"""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._count = self._counted()
        self._since_s = asyncio.get_running_loop().time()

    def silent(self, now_s: float) -> bool:
        """True once none has come for `_SILENT_S`, though the vehicle is heard."""
        count = self._counted()
        if count != self._count:
            self._count, self._since_s = count, now_s
        heard = now_s - self._connection.heard_s < _HEARD_S
        return heard and now_s - self._since_s > _SILENT_S

    def _counted(self) -> int:
        return self._connection.counts.get(MessageId.SYS_STATUS, 0)


async def become_ready(flight: Flight) -> None:
    """Wait until the autopilot would arm, in the mode in which it is to be armed.

    Raises:
        FlightAbortedError: it did not become ready in time; the text says what is missing.
        FlightRefusedError: somebody else has armed it, or chosen another mode.
    """
    connection, voice = flight.connection, flight.voice
    dialect, loop = connection.dialect, asyncio.get_running_loop()
    voice.phase("ready", f"{dialect.name}, mode {connection.mode}")
    ready_s = flight.mission.timeouts.ready_s
    deadline_s = loop.time() + ready_s
    progress = Progress(loop.time())
    # What is in the air already is in its mode, too.
    mode = dialect.mode_before_arming if flight.scope is FlightScope.WHOLE else None
    keeper = None if mode is None else ModeKeeper(connection, mode)

    reported = _Reports(connection)

    def something_to_do() -> bool:
        if keeper is not None:
            keeper.look()
        readiness = connection.readiness
        news = progress.news(readiness.missing, loop.time())
        if news is not None:
            voice.tell("info", news)
        return readiness.ready or overwritten() or only_the_mode() or reported.silent(loop.time())

    only_the_mode = OnlyTheMode(flight)

    def overwritten() -> bool:
        return mode is not None and connection.mode != mode

    while True:
        if overwritten():
            assert mode is not None
            assert keeper is not None
            if keeper.gave_way():
                voice.tell("info", f"mode {mode} gave way to {connection.mode}; asking again")
            change = await connection.exchanges.change_mode(connection.target, mode)
            if change.verdict is not Verdict.ACCEPTED:
                if loop.time() >= deadline_s:
                    raise FlightAbortedError(_not_ready(flight, ready_s))
                voice.tell("info", f"{change.explanation}; asking again")
                await connection.waiting.pause(_BETWEEN_REQUESTS_S)
                continue
        if reported.silent(loop.time()):
            voice.tell("warning", "SYS_STATUS has stopped; asking for the streams again")
            await connection.request_streams(connection.state_rate_hz)
            reported = _Reports(connection)
        await connection.waiting.until(
            something_to_do,
            max(0.0, deadline_s - loop.time()),
            lambda: _not_ready(flight, ready_s),
        )
        if connection.readiness.ready:
            return
        if only_the_mode():
            await stand_in_setpoint_mode(flight, max(1.0, deadline_s - loop.time()))
            return


def last_texts(flight: Flight) -> str:
    """The autopilot's last words, as a sentence; empty if it said nothing."""
    texts = [text for text in flight.connection.reports.texts[-3:] if text]
    return f" It said: {' / '.join(texts)}" if texts else ""


def _not_ready(flight: Flight, ready_s: float) -> str:
    missing = flight.connection.readiness.missing
    return (
        f"The autopilot did not become ready within {ready_s:g} s. "
        f"It waits for: {', '.join(missing)}." + last_texts(flight)
    )
