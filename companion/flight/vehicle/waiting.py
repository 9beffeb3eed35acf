"""Waiting for conditions on what the vehicle reports; every wait can be ended from outside."""

import asyncio
import contextlib
from collections.abc import Callable, Iterator

from companion.flight.errors import FlightAbortedError, LinkLostError


class Waiting:
    """Conditions that are waited for, looked at whenever something has come.

    Three things end a wait early, in this order: `failure` (the vehicle is gone, or we are broken:
    every coming wait fails, too), `interruption` (what a person or the vehicle did), and a
    condition that itself raises.
    """

    def __init__(self) -> None:
        self.failure: Exception | None = None
        """Ends every wait, present and coming."""
        self.interruption: Callable[[], Exception | None] = lambda: None
        """An error that ends the present wait; None to wait on."""
        self._waiters: list[tuple[Callable[[], bool], asyncio.Future[None]]] = []

    async def until(
        self, condition: Callable[[], bool], timeout_s: float | None, missing: Callable[[], str]
    ) -> None:
        """Wait until a condition holds.

        Args:
            condition: looked at now and at every `wake`.
            timeout_s: by the loop's clock; None to wait for ever.
            missing: says what did not come in time.

        Raises:
            FlightAbortedError: it did not hold within the time; the text is what `missing` says.
        """
        if not await self._holds(condition, timeout_s):
            raise FlightAbortedError(missing())

    async def pause(self, duration_s: float) -> None:
        """Let time pass, unless the wait is ended."""
        await self._holds(lambda: False, duration_s)

    def check(self) -> None:
        """Raise what would end a wait now; for the moment before something is sent."""
        error = self.failure or self.interruption()
        if error is not None:
            raise error

    async def _holds(self, condition: Callable[[], bool], timeout_s: float | None) -> bool:
        """Wait for a condition; False if the time was over first."""
        self.check()
        if condition():
            return True
        future: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        entry = (condition, future)
        self._waiters.append(entry)
        try:
            await asyncio.wait_for(future, timeout_s)
        except TimeoutError:
            return False
        finally:
            self._waiters.remove(entry)
        return True

    @property
    def vehicle_is_gone(self) -> bool:
        """True if nothing can be asked of it any more."""
        return isinstance(self.failure, LinkLostError)

    @contextlib.contextmanager
    def despite_failure(self) -> Iterator[None]:
        """Within it a failure of ours that has come ends no wait: what is left is put in order.

        One that comes meanwhile does, and that the vehicle is gone.
        """
        failure = self.failure
        if not self.vehicle_is_gone:
            self.failure = None
        try:
            yield
        finally:
            self.failure = self.failure or failure

    def fail(self, error: Exception) -> None:
        """End every wait, present and coming; the first failure stands."""
        if self.failure is None:
            self.failure = error
        self.wake()

    def wake(self) -> None:
        """Look at all conditions."""
        if not self._waiters:
            return
        for condition, future in tuple(self._waiters):
            if future.done():
                continue
            error: Exception | None
            # Whatever raises in here belongs to who waits, not to who brought the news: asyncio
            # would swallow it there, and the flight would wait for ever.
            try:
                error = self.failure or self.interruption()
                holds = error is None and condition()
            except Exception as raised:
                error, holds = raised, False
            if future.done():
                continue  # looking at it has woken us once more, from within
            if error is not None:
                future.set_exception(error)
            elif holds:
                future.set_result(None)
