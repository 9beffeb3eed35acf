"""An event loop whose clock jumps to the next timer: no waiting, no sockets."""

import asyncio
import selectors
from collections.abc import Coroutine
from typing import Any, TypeVar

T = TypeVar("T")


class _NeverWaits(selectors.DefaultSelector):
    """Instead of waiting, lets the clock jump."""

    def __init__(self) -> None:
        super().__init__()
        self.passed_s = 0.0

    def select(self, timeout: float | None = None) -> Any:
        if timeout:
            self.passed_s += timeout
        return super().select(0)


class VirtualLoop(asyncio.SelectorEventLoop):
    """Begins at any time and spends none."""

    def __init__(self, begin_s: float) -> None:
        self._clock = _NeverWaits()
        self._begin_s = begin_s
        super().__init__(self._clock)

    def time(self) -> float:
        return self._begin_s + self._clock.passed_s


def run_virtually(coroutine: Coroutine[Any, Any, T], begin_s: float = 0.0) -> T:
    with asyncio.Runner(loop_factory=lambda: VirtualLoop(begin_s)) as runner:
        return runner.run(coroutine)
