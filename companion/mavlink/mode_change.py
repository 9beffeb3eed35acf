"""A change of mode, believed only when the vehicle reports the mode.

PX4 acknowledges DO_SET_MODE twice: the first acknowledgement is always 0 and means nothing, the
second, up to 140 ms later, is the real one.  ArduPilot acknowledges a mode while it boots and
then overwrites it.  So an acknowledgement can refuse, but only CURRENT_MODE or HEARTBEAT can
confirm.
"""

import math

from companion.mavlink.commands import Ack, Command, Result, result_name
from companion.mavlink.exchange import Attempts, Patience, Verdict
from companion.mavlink.messages import Outgoing

MODE_PATIENCE = Patience(timeout_s=1.5, attempts=3)
"""A heartbeat shows the mode at most a second late."""


class ModeChange:
    """Asks for a mode until the vehicle reports it.

    Feed it with `on_ack` and `on_mode`; ask it for `outgoing` whenever `due_s` has come.
    """

    __slots__ = (
        "_acknowledged",
        "_attempts",
        "command",
        "custom_mode",
        "explanation",
        "label",
        "result",
        "verdict",
    )

    def __init__(
        self, command: Command, custom_mode: int, label: str, patience: Patience = MODE_PATIENCE
    ) -> None:
        """Ask for a mode.

        Args:
            command: the DO_SET_MODE that asks for it.
            custom_mode: what the vehicle reports once it is in the mode.
            label: the mode's name, for messages to a person.
            patience: when to ask again and when to give up.
        """
        self.command = command
        self.custom_mode = custom_mode
        self.label = label
        self.verdict = Verdict.PENDING
        self.result: int | None = None
        self.explanation = ""
        self._acknowledged = False
        self._attempts = Attempts(patience)

    @property
    def due_s(self) -> float:
        """When to call `outgoing` next (loop time); infinity once there is a verdict."""
        return self._attempts.due_s if self.verdict is Verdict.PENDING else math.inf

    def outgoing(self, now_s: float) -> list[Outgoing]:
        """What to send now: the request, if it is due, or nothing."""
        if self.verdict is not Verdict.PENDING or not self._attempts.is_due(now_s):
            return []
        if self._attempts.exhausted:
            self.verdict = Verdict.TIMED_OUT
            said = "acknowledged" if self._acknowledged else "did not acknowledge"
            self.explanation = (
                f"the autopilot {said} the change to mode {self.label}, and neither CURRENT_MODE "
                f"nor HEARTBEAT showed that mode after {self._attempts.made} attempts"
            )
            return []
        self._attempts.note_request(now_s)
        return [self.command.as_long(confirmation=self._attempts.made - 1)]

    def on_ack(self, now_s: float, ack: Ack) -> None:
        """Take an acknowledgement: 0 is noted and proves nothing, anything else refuses."""
        if self.verdict is not Verdict.PENDING or not self._attempts.answered_by(ack, self.command):
            return
        self.result = ack.result
        if ack.result in (Result.ACCEPTED, Result.IN_PROGRESS):
            self._acknowledged = True
            return
        self.verdict = Verdict.REFUSED
        self.explanation = (
            f"the autopilot refused to change to mode {self.label}: {result_name(ack.result)}"
        )

    def on_mode(self, custom_mode: int) -> None:
        """Take the mode that the vehicle reports (CURRENT_MODE or HEARTBEAT).

        A report from before the first request counts too: then the mode is as wanted already.
        """
        if self.verdict is Verdict.PENDING and custom_mode == self.custom_mode:
            self.verdict = Verdict.ACCEPTED
            self.explanation = f"mode {self.label} confirmed"
