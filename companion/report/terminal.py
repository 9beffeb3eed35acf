"""What a person sees in the terminal while flying: phases, messages, and a live line."""

import asyncio
import contextlib

from rich.console import Console
from rich.text import Text

from companion.flight.observer import TickView

_COLOURS = {"info": "cyan", "warning": "yellow", "error": "bold red"}
_TICKS_PER_REFRESH = 20
_BAR_CELLS, _FEWEST_CELLS = 12, 4
_BESIDE_BAR = 57
"""Columns of the rest of the live line: on a narrow terminal the bar is shorter."""
_CLEAR_LINE = "\r\x1b[2K"
_YELLOW, _PLAIN = "\x1b[33m", "\x1b[0m"


class TerminalObserver:
    """Shows phases, messages and, on a terminal, a live line; use as a context manager.

    The live line is written as plain text now and then from within a tick: it takes microseconds
    there, and no thread competes with the control loop.
    """

    def __init__(self, console: Console, *, verbose: bool) -> None:
        """Prepare.

        Args:
            console: where to show it.
            verbose: also show messages that are mere information.
        """
        self._console = console
        self._verbose = verbose
        self._is_live = console.is_terminal and not console.is_dumb_terminal
        self.looks_at_ticks = self._is_live
        """As an observer of a flight: without a live line they are not shown."""
        self._has_colour = console.color_system is not None and not console.no_color
        self._bar = "█·" if console.encoding.startswith("utf") else "#."
        self._begun_s: float | None = None
        self._ticks = 0
        self._line = ""

    def __enter__(self) -> "TerminalObserver":
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError, ValueError):  # the terminal may be gone
            self._clear()

    def phase(self, name: str, detail: str) -> None:
        """A phase begins: one line, with the time since the first."""
        text = Text(self._time())
        text.append(f"{name:<12}", style="bold")
        text.append(detail, style="dim")
        text.rstrip()
        self._print(text)

    def tick(self, view: TickView) -> None:
        """Refresh the live line now and then."""
        self._ticks += 1
        if not self._is_live or self._ticks % _TICKS_PER_REFRESH:
            return
        width = self._console.width
        cells = max(_FEWEST_CELLS, min(_BAR_CELLS, width - _BESIDE_BAR))
        done = round(view.progress * cells)
        bar = self._bar[0] * done + self._bar[1] * (cells - done)
        last = view.fallback or f"tilt {view.tilt_deg:4.1f}°"
        line = (
            f"{self._time()}{bar} {view.progress:4.0%}  {view.phase:<8} error "
            f"{view.tracking_error_m * 1e3:6.1f} mm  {last}"
        )
        self._line = line[: width - 1]
        if view.fallback and self._has_colour:
            self._line = _YELLOW + self._line + _PLAIN
        self._write(_CLEAR_LINE + self._line)

    def message(self, severity: str, text: str) -> None:
        """One line for a warning or an error; for other messages only when verbose."""
        if severity != "info" or self._verbose:
            said = Text(self._time())
            said.append(f"{severity}: {text}", style=_COLOURS.get(severity, ""))
            self._print(said)

    def _time(self) -> str:
        """Seconds since the first of these, by the clock of the flight: simulated in lockstep."""
        try:
            now = asyncio.get_running_loop().time()
        except RuntimeError:
            return " " * 10
        if self._begun_s is None:
            self._begun_s = now
        return f"{now - self._begun_s:6.1f} s  "

    def _print(self, text: Text) -> None:
        """A line of its own, above the live line; what is not for a terminal is not wrapped."""
        self._clear()
        self._console.print(text, soft_wrap=not self._console.is_terminal)
        if self._line:
            self._write(self._line)

    def _clear(self) -> None:
        if self._line:
            self._write(_CLEAR_LINE)

    def _write(self, text: str) -> None:
        self._console.file.write(text)
        self._console.file.flush()
