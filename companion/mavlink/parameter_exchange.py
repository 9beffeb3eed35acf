"""Reading and setting one parameter, with repetitions, until there is a verdict."""

import math
import struct

from companion.mavlink.dialects.base import ParameterEncoding
from companion.mavlink.exchange import Attempts, Patience, Verdict
from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId, Outgoing, Target
from companion.mavlink.parameters import (
    Parameter,
    ParameterError,
    ParameterType,
    error_from_frame,
    parameter_from_frame,
    read_request,
    set_request,
)


class ParameterExchange:
    """Reads a parameter and, if a value is wanted, sets it and checks that it was taken.

    A write reads first: PX4 refuses a value whose type is not the parameter's.  Feed it with
    `on_frame`; ask it for `outgoing` whenever `due_s` has come.
    """

    __slots__ = (
        "_attempts",
        "_encoding",
        "_patience",
        "_target",
        "explanation",
        "name",
        "parameter",
        "verdict",
        "wanted",
    )

    def __init__(
        self,
        name: str,
        target: Target,
        encoding: ParameterEncoding,
        wanted: float | None = None,
        patience: Patience | None = None,
    ) -> None:
        """Read `name`, and set it to `wanted` unless that is None."""
        self.name = name
        self.wanted = wanted
        self.parameter: Parameter | None = None
        """What the autopilot reported last."""
        self.verdict = Verdict.PENDING
        self.explanation = ""
        self._target = target
        self._encoding = encoding
        self._patience = patience or Patience()
        self._attempts = Attempts(self._patience)

    @property
    def due_s(self) -> float:
        """When to call `outgoing` next (loop time); infinity once there is a verdict."""
        return self._attempts.due_s if self.verdict is Verdict.PENDING else math.inf

    def outgoing(self, now_s: float) -> list[Outgoing]:
        """What to send now: a request, if it is due, or nothing."""
        if self.verdict is not Verdict.PENDING or not self._attempts.is_due(now_s):
            return []
        if self._attempts.exhausted:
            self._give_up()
            return []
        try:
            request = self._request()
        except ParameterError as error:
            self._end(Verdict.REFUSED, f"parameter {self.name} cannot be {self.wanted}: {error}")
            return []
        self._attempts.note_request(now_s)
        return [request]

    def on_frame(self, frame: Frame) -> None:
        """Take a PARAM_VALUE or PARAM_ERROR from the target; others are none of its business."""
        if self.verdict is not Verdict.PENDING or self._attempts.made == 0:
            return
        if frame.message_id == MessageId.PARAM_ERROR:
            name, problem = error_from_frame(frame)
            if name == self.name:
                self._end(Verdict.REFUSED, f"parameter {self.name}: {problem}")
        elif frame.message_id == MessageId.PARAM_VALUE:
            reported = parameter_from_frame(frame, self._encoding)
            if reported is not None and reported.name == self.name:
                self._on_value(reported)

    def _on_value(self, reported: Parameter) -> None:
        first = self.parameter is None
        self.parameter = reported
        if self.wanted is None or _same(reported, self.wanted):
            self._end(Verdict.ACCEPTED, f"parameter {self.name} is {reported.value:g}")
        elif first:
            # Now the type is known. An old value that arrives later is a late answer, no verdict.
            self._attempts = Attempts(self._patience)

    def _request(self) -> Outgoing:
        if self.parameter is None or self.wanted is None:
            return read_request(self.name, self._target)
        return set_request(
            self.name, self.wanted, self.parameter.kind, self._encoding, self._target
        )

    def _give_up(self) -> None:
        asked = f"after {self._attempts.made} attempts"
        if self.parameter is None:
            self._end(Verdict.TIMED_OUT, f"no PARAM_VALUE for {self.name} {asked}")
        else:
            self._end(
                Verdict.REFUSED,
                f"parameter {self.name} is still {self.parameter.value:g}, not "
                f"{self.wanted:g}, {asked}",
            )

    def _end(self, verdict: Verdict, explanation: str) -> None:
        self.verdict = verdict
        self.explanation = explanation


def _same(reported: Parameter, wanted: float) -> bool:
    """True if the report is what the wanted value becomes in the parameter's type."""
    if reported.kind is not ParameterType.REAL32:
        return reported.value == wanted
    try:
        return bool(struct.unpack("<f", struct.pack("<f", wanted))[0] == reported.value)
    except OverflowError:
        return False
