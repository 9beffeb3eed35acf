"""Everything that a person is told: on the display, in the log, and as STATUSTEXT on the wire."""

import asyncio
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from companion.flight.observer import Observer, TickView
from companion.mavlink.messages import Severity

_LONGEST_TEXT = 200
_LEVELS = {"info": Severity.INFO, "warning": Severity.WARNING, "error": Severity.ERROR}


class RecordLog(Protocol):
    """Where records are kept."""

    def record(self, topic: str, time_s: float, values: Mapping[str, Any]) -> None:
        """Keep a record."""


class Voice:
    """Speaks for the flight.  A display that fails is given up; it never fails the flight."""

    def __init__(
        self, observer: Observer, log: RecordLog, say: Callable[[Severity, str], None]
    ) -> None:
        """Prepare.

        Args:
            observer: the display.
            log: gets an event for each message and phase.
            say: sends a STATUSTEXT.
        """
        self._observer: Observer | None = observer
        self._looks_at_ticks = getattr(observer, "looks_at_ticks", True)
        self._log = log
        self._say = say

    def tell(self, severity: str, text: str) -> None:
        """Tell everybody; `severity` is "info", "warning" or "error"."""
        self._record(severity, text)
        self._say(_LEVELS.get(severity, Severity.ERROR), f"companion: {text}"[:_LONGEST_TEXT])
        self._show(lambda observer: observer.message(severity, text))

    def heard(self, level: int, text: str) -> None:
        """Show and record what the autopilot says; it is not sent back."""
        severity = "info"
        if level <= Severity.WARNING:
            severity = "warning" if level == Severity.WARNING else "error"
        text = f"the autopilot says: {text}"
        self._record(severity, text)
        self._show(lambda observer: observer.message(severity, text))

    def phase(self, name: str, detail: str = "") -> None:
        """A phase begins."""
        self._record("info", f"phase {name}: {detail}" if detail else f"phase {name}")
        self._show(lambda observer: observer.phase(name, detail))

    @property
    def shows_ticks(self) -> bool:
        """False if nobody looks at ticks; then they need not be told."""
        return self._looks_at_ticks and self._observer is not None

    def tick(self, view: TickView) -> None:
        """A setpoint was sent."""
        self._show(lambda observer: observer.tick(view))

    def _record(self, severity: str, text: str) -> None:
        now = asyncio.get_running_loop().time()
        self._log.record("event", now, {"severity": severity, "text": text})

    def _show(self, what: Callable[[Observer], None]) -> None:
        if self._observer is None:
            return
        try:
            what(self._observer)
        except Exception as error:
            self._observer = None
            self.tell("warning", f"the display failed ({type(error).__name__}: {error})")
