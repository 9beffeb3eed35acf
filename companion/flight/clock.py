"""A virtual clock for the event loop: simulated time, at the speed of the processor.

In lockstep nothing waits for real time: when no callback is ready, the clock jumps to the next
timer.  The same code, with the same waits, then flies deterministically.
"""

import asyncio
import selectors
from collections.abc import Coroutine
from typing import Any, TypeVar

Result = TypeVar("Result")


_LOOK_EVERY = 64
"""Rounds of the loop.  Nothing real is waited for in simulated time but signals, and a look at the
system costs as much as a small callback: this often they are noticed within milliseconds."""


class _JumpingSelector(selectors.DefaultSelector):
    """Never blocks: it tells the loop how far the clock may jump instead."""

    def __init__(self) -> None:
        super().__init__()
        self.jump_s = 0.0
        self._rounds = 0

    def select(self, timeout: float | None = None) -> Any:  # noqa: ANN401 - as in the base class
        self._rounds += 1
        if timeout is None:
            events = super().select(0)
            if not events:
                # No timer and no callback: in virtual time nothing can ever happen again.
                raise RuntimeError("deadlock in simulated time: every task waits, no timer runs")
            return events
        if timeout > 0.0:
            self.jump_s += timeout
        return () if self._rounds % _LOOK_EVERY else super().select(0)


class VirtualClockLoop(asyncio.SelectorEventLoop):
    """An event loop whose time is simulated and starts at 0."""

    def __init__(self) -> None:
        self._jumping = _JumpingSelector()
        super().__init__(self._jumping)
        # Timers that are due within this are run together; far below any interval in use.
        self._clock_resolution = 1e-9

    def time(self) -> float:
        """Simulated seconds since the loop was made."""
        return self._jumping.jump_s

    def stall(self, duration_s: float) -> None:
        """Let time pass while nothing runs, as when the whole process stands still."""
        self._jumping.jump_s += duration_s


def run_in_virtual_time(main: Coroutine[Any, Any, Result]) -> Result:
    """Run a coroutine to its end on a virtual clock."""
    with asyncio.Runner(loop_factory=VirtualClockLoop) as runner:
        return runner.run(main)
