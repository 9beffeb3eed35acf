"""Questions to the vehicle that wait for their answer: commands, changes of mode, streams."""

import asyncio
from collections.abc import Callable

from companion.flight.errors import FlightAbortedError
from companion.flight.waiting import Waiting
from companion.mavlink.command_exchange import CommandExchange, CommandQueue
from companion.mavlink.commands import Ack, Command, message_interval
from companion.mavlink.dialects.base import AutopilotDialect
from companion.mavlink.exchange import Verdict
from companion.mavlink.messages import MessageId, Outgoing, Target
from companion.mavlink.mode_change import ModeChange

_LONGEST_S = 60.0
"""No exchange takes this long by its own patience: this only guards against a bug."""


class Exchanges:
    """Asks, repeats, and gives the verdict.  An exchange whose wait was ended is dropped."""

    def __init__(
        self, waiting: Waiting, send: Callable[[Outgoing], None], dialect: AutopilotDialect
    ) -> None:
        self._waiting = waiting
        self._send = send
        self._dialect = dialect
        self._commands = CommandQueue()
        self._mode_change: ModeChange | None = None

    async def command(self, command: Command) -> CommandExchange:
        """Send a command and wait for its verdict, whatever that is."""
        self._waiting.check()
        exchange = self._commands.submit(command)
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
        change = ModeChange(
            self._dialect.set_mode(target, name), self._dialect.custom_mode(name), name
        )
        self._mode_change = change
        self.pump(asyncio.get_running_loop().time())
        try:
            await self._waiting.until(
                lambda: change.verdict is not Verdict.PENDING,
                _LONGEST_S,
                lambda: f"no verdict on the change to mode {name} within {_LONGEST_S:g} s",
            )
        finally:
            self._mode_change = None
        return change

    async def request_streams(self, target: Target, state_rate_hz: float) -> None:
        """Ask for the dialect's streams, the state at the given rate.

        Raises:
            FlightAbortedError: a stream that is needed was refused.
        """
        for stream in self._dialect.streams:
            interval = stream.interval_s
            if stream.message_id is MessageId.ODOMETRY:
                interval = 1.0 / state_rate_hz
            exchange = await self.command(
                message_interval(target, int(stream.message_id), interval)
            )
            if exchange.verdict is not Verdict.ACCEPTED and stream.required:
                raise FlightAbortedError(
                    f"The autopilot does not stream {stream.message_id.name}, without which there "
                    f"is no flight: {exchange.explanation}."
                )

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

    def on_mode(self, custom_mode: int) -> None:
        """Take a report of the vehicle's mode."""
        if self._mode_change is not None:
            self._mode_change.on_mode(custom_mode)
