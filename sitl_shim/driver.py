"""Drives the shim by an event loop's clock; real or virtual makes no difference."""

import asyncio
from collections.abc import Callable

from sitl_shim.autopilot.interface import TICK_S
from sitl_shim.mavlink.endpoint import Datagram, Shim
from sitl_shim.sensors.camera import MocapCamera

_TICKS_AT_ONCE = 25
"""After a stall, so many ticks are caught up before sockets are looked at again."""
_MOST_BEHIND_S = 1.0
"""A longer stall (a suspended process, a machine that is too slow) stops the boot clock."""

Deliver = Callable[[int, bytes], None]
"""Takes the index of a link and the bytes that its client receives."""


class LoopDriver:
    """Steps a shim at absolute deadlines of the running loop's clock.

    Args:
        shim: what is stepped.
        speed: simulated seconds per second of the loop.
        deliver: takes what clients receive, one MAVLink message per call.
        room: the room's cameras, and who receives their frames; None if there are none.
    """

    def __init__(
        self,
        shim: Shim,
        *,
        speed: float,
        deliver: Deliver,
        room: tuple[MocapCamera, Callable[[bytes], None]] | None = None,
    ) -> None:
        self._room = room
        self._shim = shim
        self._speed = speed
        self._tick_s = TICK_S / speed
        self._deliver = deliver
        self._loop: asyncio.AbstractEventLoop | None = None
        self._start = 0.0
        self._tick = 0
        self._timer: asyncio.TimerHandle | None = None
        self._failed: asyncio.Future[None] | None = None

    def receive(self, link: int, data: bytes) -> None:
        """Take what a client sends, now; what comes before `run` is lost.

        While the simulation is behind the loop's clock, now is its next tick: a slow autopilot
        answers late by its slowness, not by all that it has to catch up.
        """
        if self._loop is not None:
            time_s = (self._loop.time() - self._start) * self._speed
            self._shim.receive(link, data, min(time_s, self._shim.time_s + TICK_S))

    async def run(self) -> None:
        """Fly until cancelled; the shim's boot is the moment at which this starts."""
        self._loop = loop = asyncio.get_running_loop()
        self._failed = loop.create_future()
        self._start = loop.time()
        self._set_timer()
        try:
            await self._failed
        finally:
            if self._timer is not None:
                self._timer.cancel()
            self._loop = None

    def _set_timer(self) -> None:
        if self._loop is not None:
            when = self._start + (self._tick + 1) * self._tick_s
            self._timer = self._loop.call_at(when, self._on_time)

    def _on_time(self) -> None:
        loop = self._loop
        if loop is None:
            return
        try:
            for _ in range(_TICKS_AT_ONCE):
                self._step(loop)
                behind_s = loop.time() - (self._start + (self._tick + 1) * self._tick_s)
                if behind_s < 0.0:
                    break
            else:
                self._start += max(0.0, behind_s - _MOST_BEHIND_S)
        except Exception as error:
            self._fail(error)
            return
        self._set_timer()

    def _fail(self, error: Exception) -> None:
        """End `run` with an error that came up in a timer."""
        if self._failed is not None and not self._failed.done():
            self._failed.set_exception(error)

    def _step(self, loop: asyncio.AbstractEventLoop) -> None:
        self._tick += 1
        datagrams = self._shim.step()
        if self._room is not None:
            camera, receive = self._room
            frame = camera.look(self._shim.simulation.state)
            if frame is not None:
                loop.call_at(self._start + frame.due_s / self._speed, receive, frame.data)
        if not datagrams:
            return
        # All that leaves at a tick arrives together.
        due_s = datagrams[0].due_s
        if due_s <= self._shim.time_s:
            self._hand_over(datagrams)
        else:
            loop.call_at(self._start + due_s / self._speed, self._hand_over, datagrams)

    def _hand_over(self, datagrams: list[Datagram]) -> None:
        if self._loop is None:
            return
        deliver = self._deliver
        try:
            for _, link, data in datagrams:
                deliver(link, data)
        except Exception as error:
            self._fail(error)
