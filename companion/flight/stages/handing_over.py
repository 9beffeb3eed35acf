"""Giving the vehicle to its autopilot by commanding a mode, while the last setpoints still hold it.

PX4 needs none of this: its own failsafe acts once the stream has stopped.  ArduPilot would keep
the last target for GUID_TIMEOUT and then drift, level, with no text and no change of mode.  So it
is commanded to BRAKE (else to LAND); meanwhile the stream goes on, level and holding altitude,
until a heartbeat confirms the mode or `HOLD_S` has passed.
"""

import asyncio

from companion.flight.vehicle.connection import Connection
from companion.flight.voice import Voice
from companion.mavlink.exchange import Patience, Verdict
from companion.mavlink.setpoints import AttitudeSetpoint, InvalidSetpointError, setpoint_message

HOLD_S = 1.0
"""So long is the vehicle held at most while the mode is not confirmed."""
_PERIOD_S = 0.02
_PATIENCE = Patience(timeout_s=0.5, attempts=20)
"""Long: what is sent may not arrive for a while, and without it the vehicle drifts."""


class HandingOver:
    """Commands the modes of the dialect's hand-over, one after another if one is refused."""

    def __init__(self, connection: Connection, voice: Voice) -> None:
        self._connection = connection
        self._voice = voice
        self._task: asyncio.Task[None] | None = None
        self._hold: AttitudeSetpoint | None = None
        """What is sent until the mode is confirmed."""
        self.ours = False
        """True while the companion flies the vehicle: another's is not given to anybody."""

    @property
    def possible(self) -> bool:
        """True if the vehicle obeys setpoints of ours and there is a mode to command.

        False also once it has been begun: it is not begun again until we have flown again.
        """
        connection = self._connection
        return (
            self._task is None
            and self.ours
            and connection.dialect_known
            and bool(connection.dialect.hand_over.modes)
            and connection.reports.armed
            and connection.mode == connection.dialect.setpoint_mode
            and connection.exchanges.asked_mode not in connection.dialect.hand_over.modes
        )

    def begin(self, hold: AttitudeSetpoint | None) -> None:
        """Begin, if it is possible; returns at once.

        Args:
            hold: what to send until the mode is confirmed; None to send nothing.
        """
        if self.possible:
            self._hold = hold
            self._task = asyncio.get_running_loop().create_task(self._run())

    def hold_no_longer(self) -> None:
        """Command on, but send no setpoint meanwhile."""
        self._hold = None

    def cancel(self) -> None:
        """Command nothing more: we fly again."""
        if self._task is not None:
            self._task.cancel()
            self._task = None

    async def finished(self) -> None:
        """Wait until the mode is confirmed, or given up."""
        if self._task is not None:
            await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self) -> None:
        connection = self._connection
        for mode in connection.dialect.hand_over.modes:
            verdict = await self._command(mode)
            if verdict is None:
                return
            if verdict is Verdict.ACCEPTED:
                self._voice.tell("info", f"handed over: the autopilot is in mode {mode}")
                return
            if verdict is Verdict.TIMED_OUT:
                # It may well have obeyed: what is lost is most likely the way back to us.
                self._voice.tell("error", f"mode {mode} was commanded and not confirmed")
                return
            self._hold = None
        self._voice.tell(
            "error",
            "the autopilot refused every mode of the hand-over: it levels out and drifts. Take "
            "over by remote control",
        )

    async def _command(self, mode: str) -> Verdict | None:
        """Command a mode until there is a verdict; None if somebody else chose another one."""
        connection, loop = self._connection, asyncio.get_running_loop()
        ours = (connection.dialect.setpoint_mode, mode)
        begun_s = loop.time()
        change = connection.exchanges.begin_mode_change(connection.target, mode, _PATIENCE)
        try:
            while change.verdict is Verdict.PENDING:
                if connection.mode not in ours or not connection.reports.armed:
                    return None
                if self._hold is not None and loop.time() - begun_s < HOLD_S:
                    self._send(self._hold)
                connection.exchanges.pump(loop.time())
                await asyncio.sleep(_PERIOD_S)
        finally:
            connection.exchanges.drop_mode_change(change)
        if change.verdict is Verdict.REFUSED:
            self._voice.tell("warning", change.explanation)
        return change.verdict

    def _send(self, hold: AttitudeSetpoint) -> None:
        connection = self._connection
        now_s = asyncio.get_running_loop().time()
        if connection.clock.valid:
            autopilot_s = connection.clock.autopilot_time(now_s)
        else:
            autopilot_s = 0.0 if connection.state is None else connection.state.time_s
        try:
            message = setpoint_message(hold, max(0.0, autopilot_s), connection.target)
        except InvalidSetpointError:
            return  # without a time it is better not sent; the mode is commanded all the same
        connection.send(message)
