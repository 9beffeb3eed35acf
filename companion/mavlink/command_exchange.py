"""One command until its final acknowledgement, and many commands one after another."""

import math
from collections import deque
from dataclasses import dataclass

from companion.mavlink.commands import Ack, Command, CommandId, Result, result_name
from companion.mavlink.exchange import Attempts, Patience, Verdict
from companion.mavlink.messages import Outgoing

_AT_IT = (Result.IN_PROGRESS,)
_HEARTBEATS_S = 3.0
"""Wait for a HEARTBEAT that says what became of an arming command."""
_SECOND_THOUGHT_S = 0.1
"""Between one that says disarmed and arming again: who has reasons to end it does so meanwhile."""


def arms(command: Command) -> bool:
    """True for a command that starts the motors."""
    return command.command_id == CommandId.COMPONENT_ARM_DISARM and command.params[0] != 0.0


class CommandExchange:
    """Sends a command, repeats it while nobody answers, and judges the acknowledgements.

    Feed it with `on_ack`; ask it for `outgoing` whenever `due_s` has come.

    Arming differs: repeated behind somebody's back it would start motors that they have stopped.
    So HEARTBEAT answers it as well (`on_heartbeat`): armed ends it, and it is repeated only on the
    word of one that came later than an answer would have, and says disarmed.
    """

    __slots__ = (
        "_arms", "_attempts", "_awaits_word", "_working", "command", "explanation", "result",
        "verdict",
    )  # fmt: skip

    def __init__(self, command: Command, patience: Patience | None = None) -> None:
        self.command = command
        self.verdict = Verdict.PENDING
        self.result: int | None = None
        """The last acknowledgement's MAV_RESULT."""
        self.explanation = ""
        """One sentence on how it ended, for a person."""
        self._attempts = Attempts(patience or Patience())
        self._working = False
        self._arms = arms(command)
        self._awaits_word = False

    @property
    def due_s(self) -> float:
        """When to call `outgoing` next (loop time); infinity once there is a verdict."""
        return self._attempts.due_s if self.verdict is Verdict.PENDING else math.inf

    @property
    def begun(self) -> bool:
        """True once it was sent."""
        return self._attempts.made > 0

    @property
    def unanswered(self) -> int:
        """Requests whose final acknowledgement has not come."""
        acknowledged = self.result is not None and self.result not in _AT_IT
        judged = acknowledged and self.verdict in (Verdict.ACCEPTED, Verdict.REFUSED)
        return self._attempts.made - judged

    @property
    def answers_until_s(self) -> float:
        """Loop time after which no answer to its requests is expected any more."""
        return self._attempts.asked_s + self._attempts.patience.timeout_s

    def outgoing(self, now_s: float) -> list[Outgoing]:
        """What to send now: the command, if it is due, or nothing."""
        if self.verdict is not Verdict.PENDING or not self._attempts.is_due(now_s):
            return []
        if self._working or self._awaits_word or self._attempts.exhausted:
            self._end(Verdict.TIMED_OUT, self._silence())
            return []
        self._attempts.note_request(now_s)
        if self._arms:
            self._awaits_word = True
            self._attempts.wait(now_s + _HEARTBEATS_S)
        return [self.command.as_long(confirmation=self._attempts.made - 1)]

    def on_ack(self, now_s: float, ack: Ack) -> None:
        """Take an acknowledgement that came from the command's target."""
        if self.verdict is not Verdict.PENDING or not self._attempts.answered_by(ack, self.command):
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

    def on_heartbeat(self, now_s: float, armed: bool) -> None:
        """Take the word of the command's target on whether it is armed; it answers arming alone."""
        if self.verdict is not Verdict.PENDING or not self._arms or not self.begun:
            return
        if armed:
            self._end(
                Verdict.ACCEPTED,
                f"no COMMAND_ACK came for {self.command.label}, but the autopilot's HEARTBEAT "
                "says armed",
            )
        elif self._awaits_word and not self._working and now_s >= self.answers_until_s:
            self._awaits_word = False
            self._attempts.wait(now_s + _SECOND_THOUGHT_S)

    def on_restart(self) -> None:
        """The target has restarted: what it was to arm for is over."""
        if self.verdict is Verdict.PENDING and self._arms:
            self._end(Verdict.TIMED_OUT, f"the autopilot restarted during {self.command.label}")

    def _silence(self) -> str:
        if self._working:
            return f"the autopilot began {self.command.label} and never said that it was done"
        if self._awaits_word:
            return (
                f"no COMMAND_ACK came for {self.command.label}, and for {_HEARTBEATS_S:g} s no "
                "HEARTBEAT that says whether it is armed"
            )
        if self._arms:
            return (
                f"no COMMAND_ACK for {self.command.label} after {self._attempts.made} attempts, "
                "and HEARTBEAT says disarmed"
            )
        return (
            f"no COMMAND_ACK for {self.command.label} after {self._attempts.made} attempts in "
            f"{self._attempts.made * self._attempts.patience.timeout_s:g} s"
        )

    def _end(self, verdict: Verdict, explanation: str) -> None:
        self.verdict = verdict
        self.explanation = explanation


@dataclass(slots=True)
class _Late:
    """Acknowledgements that may still come for a command that has its verdict."""

    count: int
    until_s: float


class CommandQueue:
    """Commands in order, one at a time: an acknowledgement names no more than the command's id.

    Several requests of the same id (message intervals, say) could not be told apart otherwise.
    For the same reason a command waits until the one of its id before it has been answered as
    often as it was sent, or until that answer is later than `Patience.timeout_s`: then it counts
    as lost.  After a command that was sent once and answered, nothing waits.
    """

    __slots__ = ("_late", "_patience", "_waiting")

    def __init__(self, patience: Patience | None = None) -> None:
        self._patience = patience
        self._waiting: deque[CommandExchange] = deque()
        self._late: dict[int, _Late] = {}

    def submit(self, command: Command, patience: Patience | None = None) -> CommandExchange:
        """Put a command at the end of the queue; the exchange tells its verdict later.

        Args:
            command: to be sent.
            patience: with it; the queue's own by default.
        """
        exchange = CommandExchange(command, patience or self._patience)
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
        if not self._waiting:
            return math.inf
        first = self._waiting[0]
        late = self._late.get(first.command.command_id)
        return first.due_s if late is None else max(first.due_s, late.until_s)

    def outgoing(self, now_s: float) -> list[Outgoing]:
        """What to send now."""
        self._drop_finished()
        while self._waiting:
            first = self._waiting[0]
            if self._is_held(first, now_s):
                return []
            packets = first.outgoing(now_s)
            if first.verdict is Verdict.PENDING:
                return packets
            self._drop_finished()
        return []

    def on_ack(self, now_s: float, ack: Ack) -> None:
        """Take an acknowledgement from the commands' target."""
        self._drop_finished()
        late = self._late.get(ack.command_id)
        if late is not None and ack.result not in _AT_IT:
            late.count -= 1
            if late.count == 0:
                del self._late[ack.command_id]
        if self._waiting:
            self._waiting[0].on_ack(now_s, ack)  # does not take it while it is held: not sent yet

    def on_heartbeat(self, now_s: float, armed: bool) -> None:
        """Take the word of the commands' target on whether it is armed."""
        self._drop_finished()
        if self._waiting:
            self._waiting[0].on_heartbeat(now_s, armed)

    def on_restart(self) -> None:
        """The commands' target has restarted: it is not armed again."""
        for exchange in self._waiting:
            exchange.on_restart()

    def _is_held(self, exchange: CommandExchange, now_s: float) -> bool:
        """True while an acknowledgement could be the last command's of the same id."""
        late = self._late.get(exchange.command.command_id)
        if late is None:
            return False
        if now_s < late.until_s:
            return True
        del self._late[exchange.command.command_id]
        return False

    def _drop_finished(self) -> None:
        while self._waiting and self._waiting[0].verdict is not Verdict.PENDING:
            done = self._waiting.popleft()
            if done.begun and done.unanswered > 0:
                self._late[done.command.command_id] = _Late(done.unanswered, done.answers_until_s)
