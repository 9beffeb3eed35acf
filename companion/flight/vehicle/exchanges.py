"""Questions to the vehicle that wait for their answer: commands, changes of mode, streams."""

import asyncio
from collections.abc import Callable
from dataclasses import replace

from companion.flight.errors import FlightAbortedError
from companion.flight.vehicle.waiting import Waiting
from companion.mavlink.command_exchange import CommandExchange, CommandQueue, arms
from companion.mavlink.commands import Ack, Command, message_interval
from companion.mavlink.dialects.base import AutopilotDialect, Stream
from companion.mavlink.exchange import Patience, Verdict
from companion.mavlink.messages import MessageId, Outgoing, Target
from companion.mavlink.mode_change import MODE_PATIENCE, ModeChange
from companion.mavlink.state_source import (
    PARTS_IN_PLACE_OF_ODOMETRY,
    STATE_MESSAGES,
    StateSource,
)

_ARMING = Patience(attempts=6)
"""However bad the link: each attempt waits for a HEARTBEAT, and arming is not to be insisted on."""
_AT_FIRST = Patience(attempts=10)
"""With the first questions, before anything is known of the link: a third of the packets lost both
ways leaves half of them unanswered."""
_LONGEST_S = 60.0
"""No exchange takes this long by its own patience: this only guards against a bug."""


class Exchanges:
    """Asks, repeats, and gives the verdict.  An exchange whose wait was ended is dropped."""

    def __init__(
        self,
        waiting: Waiting,
        send: Callable[[Outgoing], None],
        dialect: Callable[[], AutopilotDialect],
        patience: Callable[[Patience], Patience],
    ) -> None:
        """Prepare.

        Args:
            waiting: what everything here waits on.
            send: sends a message to the vehicle.
            dialect: the vehicle's, once it is known.
            patience: makes what the link needs of a usual patience.
        """
        self._waiting = waiting
        self._send = send
        self._dialect = dialect
        self._patience = patience
        self._commands = CommandQueue()
        self._mode_change: ModeChange | None = None

    async def command(
        self,
        command: Command,
        usual: Patience = Patience(),  # noqa: B008 - it is frozen
    ) -> CommandExchange:
        """Send a command and wait for its verdict, whatever that is.

        Args:
            command: what to ask for.
            usual: how patiently, on a good link.
        """
        self._waiting.check()
        patience = _ARMING if arms(command) else self._patience(usual)
        exchange = self._commands.submit(command, patience)
        self.pump(asyncio.get_running_loop().time())
        try:
            await self._waiting.until(
                lambda: exchange.verdict is not Verdict.PENDING,
                _LONGEST_S,
                lambda: f"no verdict on {command.label} within {_LONGEST_S:g} s",
            )
        finally:
            if exchange.verdict is Verdict.PENDING:
                # Nobody waits for it any more, so it must not be repeated behind our back: a
                # take-off repeated after the person asked to land would be one.
                exchange.verdict = Verdict.TIMED_OUT
        return exchange

    async def change_mode(self, target: Target, name: str) -> ModeChange:
        """Ask for a mode and wait until the vehicle reports it, or refuses."""
        self._waiting.check()
        change = self.begin_mode_change(target, name)
        try:
            await self._waiting.until(
                lambda: change.verdict is not Verdict.PENDING,
                _LONGEST_S,
                lambda: f"no verdict on the change to mode {name} within {_LONGEST_S:g} s",
            )
        finally:
            self.drop_mode_change(change)
        return change

    def begin_mode_change(
        self, target: Target, name: str, patience: Patience = MODE_PATIENCE
    ) -> ModeChange:
        """Ask for a mode now, in place of any that is being asked for; nobody waits for it here."""
        dialect = self._dialect()
        change = ModeChange(
            dialect.set_mode(target, name),
            dialect.custom_mode(name),
            name,
            self._patience(patience),
        )
        self._mode_change = change
        self.pump(asyncio.get_running_loop().time())
        return change

    @property
    def asked_mode(self) -> str | None:
        """The mode that is being asked for now."""
        return None if self._mode_change is None else self._mode_change.label

    def drop_mode_change(self, change: ModeChange) -> None:
        """Ask for it no longer."""
        if self._mode_change is change:
            self._mode_change = None

    async def request_streams(
        self, target: Target, state_rate_hz: float
    ) -> tuple[StateSource, tuple[Stream, ...]]:
        """Ask for the dialect's streams, the state at the given rate.

        Where ODOMETRY is refused, position and attitude are asked for in its place.

        Returns:
            What the state is made of, and what was granted, at the intervals that were asked for.

        Raises:
            FlightAbortedError: a stream that is needed was refused.
        """
        source = StateSource.PARTS
        granted: list[Stream] = []
        wanted = list(self._dialect().streams)
        while wanted:
            stream = wanted.pop(0)
            if stream.message_id in STATE_MESSAGES:
                stream = replace(stream, interval_s=1.0 / state_rate_hz)
            exchange = await self.command(
                message_interval(target, int(stream.message_id), stream.interval_s), _AT_FIRST
            )
            is_odometry = stream.message_id is MessageId.ODOMETRY
            if exchange.verdict is Verdict.ACCEPTED:
                granted.append(stream)
                if is_odometry:
                    source = StateSource.ODOMETRY
            elif exchange.verdict is Verdict.REFUSED and is_odometry:
                wanted[:0] = PARTS_IN_PLACE_OF_ODOMETRY
            elif stream.required:
                raise FlightAbortedError(
                    f"The autopilot does not stream {stream.message_id.name}, without which there "
                    f"is no flight: {exchange.explanation}."
                )
        return source, tuple(granted)

    def pump(self, now_s: float) -> None:
        """Send what is due, and judge what is overdue."""
        for outgoing in self._commands.outgoing(now_s):
            self._send(outgoing)
        if self._mode_change is not None:
            for outgoing in self._mode_change.outgoing(now_s):
                self._send(outgoing)

    def on_ack(self, now_s: float, ack: Ack) -> None:
        """Take an acknowledgement of the vehicle."""
        self._commands.on_ack(now_s, ack)
        if self._mode_change is not None:
            self._mode_change.on_ack(now_s, ack)
        self.pump(now_s)

    def on_heartbeat(self, now_s: float, armed: bool) -> None:
        """Take the vehicle's word on whether it is armed."""
        self._commands.on_heartbeat(now_s, armed)
        self.pump(now_s)

    def on_restart(self) -> None:
        """The vehicle's autopilot has restarted: it is not armed again."""
        self._commands.on_restart()

    def on_mode(self, custom_mode: int) -> None:
        """Take a report of the vehicle's mode."""
        if self._mode_change is not None:
            self._mode_change.on_mode(custom_mode)
