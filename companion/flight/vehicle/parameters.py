"""The autopilot's parameters: read, and set when a person has said so."""

import asyncio
from collections.abc import Iterable

from companion.flight.vehicle.connection import Connection
from companion.mavlink.exchange import Patience, Verdict
from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId
from companion.mavlink.parameter_exchange import ParameterExchange

_LONGEST_S = 60.0
"""No exchange takes this long by its own patience: this only guards against a bug."""


_READING = Patience(timeout_s=0.3, attempts=3)
"""Short: some names do not exist in every release, and ArduPilot says nothing to those."""


class Parameters:
    """Parameter exchanges with the vehicle at the other end of a connection."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._pending: list[ParameterExchange] = []
        for message_id in (MessageId.PARAM_VALUE, MessageId.PARAM_ERROR):
            connection.listeners.setdefault(int(message_id), []).append(self._on_frame)
        connection.chores.append(self._pump)

    async def read(self, names: Iterable[str], patience: Patience = _READING) -> dict[str, float]:
        """Values of those parameters that the autopilot has; the others are left out.

        Args:
            names: which; all are asked for at once.
            patience: with each of them.

        Raises:
            FlightAbortedError: the wait was ended from outside.
        """
        exchanges = [self._begin(name, None, patience) for name in names]
        await self._settle(exchanges)
        return {
            exchange.name: float(exchange.parameter.value)
            for exchange in exchanges
            if exchange.parameter is not None
        }

    async def set(self, name: str, value: float) -> ParameterExchange:
        """Set a parameter and check that it was taken; the exchange tells how it went.

        Raises:
            FlightAbortedError: the wait was ended from outside.
        """
        exchange = self._begin(name, value)
        await self._settle([exchange])
        return exchange

    def close(self) -> None:
        """Listen no more; exchanges that were begun come to nothing."""
        self._pending = []
        for message_id in (MessageId.PARAM_VALUE, MessageId.PARAM_ERROR):
            self._connection.listeners[int(message_id)].remove(self._on_frame)
        self._connection.chores.remove(self._pump)

    def _begin(
        self, name: str, wanted: float | None, patience: Patience | None = None
    ) -> ParameterExchange:
        connection = self._connection
        exchange = ParameterExchange(
            name,
            connection.target,
            connection.dialect.parameter_encoding,
            wanted,
            connection.losses.patience(patience or Patience()),
        )
        self._pending.append(exchange)
        return exchange

    async def _settle(self, exchanges: list[ParameterExchange]) -> None:
        self._pump(asyncio.get_running_loop().time())
        try:
            await self._connection.waiting.until(
                lambda: all(e.verdict is not Verdict.PENDING for e in exchanges),
                _LONGEST_S,
                lambda: "no verdict on the parameters that were asked for",
            )
        finally:
            # Nobody waits for these any more, so nothing may be set behind our back.
            self._pending = [e for e in self._pending if e not in exchanges]

    def _pump(self, now_s: float) -> None:
        for exchange in self._pending:
            for outgoing in exchange.outgoing(now_s):
                self._connection.send(outgoing)

    def _on_frame(self, frame: Frame, received_s: float) -> None:
        for exchange in self._pending:
            exchange.on_frame(frame)
        self._pump(received_s)
