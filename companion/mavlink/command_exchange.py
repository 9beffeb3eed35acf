"""One command until its final acknowledgement, and many commands one after another."""

import math
from collections import deque

from companion.mavlink.commands import Ack, Command, Result, result_name
from companion.mavlink.exchange import Attempts, Patience, Verdict
from companion.mavlink.messages import Outgoing

_AT_IT = (Result.IN_PROGRESS,)


class CommandExchange:
    """Sends a command, repeats it while nobody answers, and judges the acknowledgements.

    Feed it with `on_ack`; ask it for `outgoing` whenever `due_s` has come.
    """

    __slots__ = ("_attempts", "_working", "command", "explanation", "result", "verdict")

    def __init__(self, command: Command, patience: Patience | None = None) -> None:
        self.command = command
        self.verdict = Verdict.PENDING
        self.result: int | None = None
        """The last acknowledgement's MAV_RESULT."""
        self.explanation = ""
        """One sentence on how it ended, for a person."""
        self._attempts = Attempts(patience or Patience())
        self._working = False

    @property
    def due_s(self) -> float:
        """When to call `outgoing` next (loop time); infinity once there is a verdict."""
        return self._attempts.due_s if self.verdict is Verdict.PENDING else math.inf

    def outgoing(self, now_s: float) -> list[Outgoing]:
        """What to send now: the command, if it is due, or nothing."""
        if self.verdict is not Verdict.PENDING or not self._attempts.is_due(now_s):
            return []
        if self._working or self._attempts.exhausted:
            self._end(Verdict.TIMED_OUT, self._silence())
            return []
        self._attempts.note_request(now_s)
        return [self.command.as_long(confirmation=self._attempts.made - 1)]

    def on_ack(self, now_s: float, ack: Ack) -> None:
        """Take an acknowledgement that came from the command's target."""
        if (
            self.verdict is not Verdict.PENDING
            or ack.command_id != self.command.command_id
            or self._attempts.made == 0
        ):
            return
        self.result = ack.result
        if ack.result in _AT_IT:
            self._working = True
            self._attempts.wait(now_s + self._attempts.patience.in_progress_timeout_s)
        elif ack.result == Result.ACCEPTED:
            self._end(Verdict.ACCEPTED, f"{self.command.label} accepted")
        else:
            self._end(
                Verdict.REFUSED,
                f"the autopilot refused {self.command.label}: {result_name(ack.result)}",
            )

    def _silence(self) -> str:
        if self._working:
            return f"the autopilot began {self.command.label} and never said that it was done"
        return (
            f"no COMMAND_ACK for {self.command.label} after {self._attempts.made} attempts in "
            f"{self._attempts.made * self._attempts.patience.timeout_s:g} s"
        )

    def _end(self, verdict: Verdict, explanation: str) -> None:
        self.verdict = verdict
        self.explanation = explanation


class CommandQueue:
    """Commands in order, one at a time: an acknowledgement names no more than the command's id.

    Several requests of the same id (message intervals, say) could not be told apart otherwise.
    """

    __slots__ = ("_patience", "_waiting")

    def __init__(self, patience: Patience | None = None) -> None:
        self._patience = patience
        self._waiting: deque[CommandExchange] = deque()

    def submit(self, command: Command) -> CommandExchange:
        """Put a command at the end of the queue; the exchange tells its verdict later."""
        exchange = CommandExchange(command, self._patience)
        self._waiting.append(exchange)
        return exchange

    @property
    def idle(self) -> bool:
        """True if every command has its verdict."""
        self._drop_finished()
        return not self._waiting

    @property
    def due_s(self) -> float:
        """When to call `outgoing` next (loop time)."""
        self._drop_finished()
        return self._waiting[0].due_s if self._waiting else math.inf

    def outgoing(self, now_s: float) -> list[Outgoing]:
        """What to send now."""
        while self._waiting:
            packets = self._waiting[0].outgoing(now_s)
            if self._waiting[0].verdict is Verdict.PENDING:
                return packets
            self._waiting.popleft()
        return []

    def on_ack(self, now_s: float, ack: Ack) -> None:
        """Take an acknowledgement from the commands' target."""
        self._drop_finished()
        if self._waiting:
            self._waiting[0].on_ack(now_s, ack)

    def _drop_finished(self) -> None:
        while self._waiting and self._waiting[0].verdict is not Verdict.PENDING:
            self._waiting.popleft()
