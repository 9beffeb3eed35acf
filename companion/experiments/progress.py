"""How far a study is, for a person: a bar on a terminal, a line now and then elsewhere."""

import sys
import time
from collections.abc import Callable
from typing import TextIO

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TaskID, TextColumn
from rich.progress import Progress as Bar

_LINE_EVERY_S = 30.0
_WIDE = 1000

Progress = Callable[[int, int, float | None], None]
"""Told what is done, how much there is in all, and the seconds that remain (None: not known
yet)."""


class Pace:
    """How far it is, and how long the rest takes at the pace so far."""

    def __init__(self, done: int, total: int, progress: Progress | None) -> None:
        """Begin to count.

        Args:
            done: was done before, and took no time now.
            total: in all.
            progress: told at each tick; None: nobody is.
        """
        self._before = done
        self._done = done
        self._total = total
        self._progress = progress
        self._started_s = time.perf_counter()

    def tick(self, count: int = 1) -> None:
        """One more is done, or several at once."""
        self._done += count
        self.tell()

    def tell(self) -> None:
        """Tell how far it is."""
        if self._progress is None:
            return
        made = self._done - self._before
        elapsed = time.perf_counter() - self._started_s
        rest = self._total - self._done
        remaining = elapsed / made * rest if made else None
        self._progress(self._done, self._total, 0.0 if not rest else remaining)


class ProgressDisplay:
    """Shows done of total and the remaining time; to be used in a `with` statement.

    An object of it is what `run_campaign` takes as `progress`.
    """

    def __init__(
        self,
        title: str,
        unit: str = "flights",
        stream: TextIO | None = None,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """Prepare.

        Args:
            title: what is going on, in a word or two.
            unit: what is counted.
            stream: where to show it; stderr by default.
            now_s: a clock for the pauses between plain lines.
        """
        stream = stream or sys.stderr
        width = None if stream.isatty() else _WIDE
        self._console = Console(file=stream, highlight=False, width=width)
        self._title = title
        self._unit = unit
        self._now_s = now_s
        self._line_due_s = now_s()
        self._note = ""
        self._bar: Bar | None = None
        self._task = TaskID(0)
        if self._console.is_terminal and not self._console.is_dumb_terminal:
            self._bar = Bar(
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[rest]}"),
                console=self._console,
                transient=True,
                refresh_per_second=4,
            )
            self._task = self._bar.add_task(title, total=None, rest="")

    def __enter__(self) -> "ProgressDisplay":
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def note(self, text: str) -> None:
        """Say something beside the figures from now on ("best 31 mm")."""
        self._note = text

    def say(self, text: str) -> None:
        """Say something once, on a line of its own."""
        self._console.print(text, markup=False)

    def __call__(self, done: int, total: int, remaining_s: float | None) -> None:
        """Show how far it is.

        Args:
            done: of `total`.
            total: how many there are.
            remaining_s: None as long as nobody knows.
        """
        rest = ", ".join(part for part in (self._note, _rest(remaining_s)) if part)
        if self._bar is not None:
            self._bar.update(self._task, completed=done, total=total, rest=rest)
            return
        now = self._now_s()
        if now >= self._line_due_s or done == total:
            self._line_due_s = now + _LINE_EVERY_S
            said = f"{self._title}: {done} of {total} {self._unit}"
            self.say(f"{said}, {rest}" if rest else said)


def _rest(remaining_s: float | None) -> str:
    if not remaining_s:
        return ""
    minutes, seconds = divmod(round(remaining_s), 60)
    return f"{minutes} min {seconds:02d} s left" if minutes else f"{seconds} s left"
