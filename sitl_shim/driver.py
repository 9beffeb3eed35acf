"""Drives the shim by an event loop's clock; real or virtual makes no difference."""

import asyncio
from collections.abc import Callable, Sequence
from math import inf

from sitl_shim.autopilot.interface import TICK_S
from sitl_shim.faults.link import LinkFaults, LinkWay, link_faults
from sitl_shim.mavlink.babble import babble_packets
from sitl_shim.mavlink.endpoint import Datagram, Shim
from sitl_shim.mavlink.messages_truth import TRUTH_COMPONENT_ID
from sitl_shim.sensors.camera import MocapCamera
from sitl_shim.simulation import ShimOptions

_TICKS_AT_ONCE = 25
"""After a stall, so many ticks are caught up before sockets are looked at again."""
_MOST_BEHIND_S = 1.0
"""A longer stall (a suspended process, a machine that is too slow) stops the boot clock."""

_ROUNDING_S = 5e-7
"""What is due at this very moment is due, whatever the clock's rounding says."""
_MAVLINK_2 = 0xFD
_COMPONENT_AT = 6
"""Where a MAVLink 2 frame has the sender's component."""

Deliver = Callable[[int, bytes], None]
"""Takes the index of a link and the bytes that its client receives."""


def faults_on_links(shim: Shim, options: ShimOptions, links: int) -> LinkFaults:
    """What the links of a shim do to packets.

    Args:
        shim: made of these options.
        options: what is simulated.
        links: how many links it has.
    """
    simulation = shim.simulation
    packets = babble_packets(options.system_id)
    return link_faults(
        simulation.faults,
        simulation.moments,
        seed=options.seed,
        links=links,
        babble=lambda _: packets,
    )


class LoopDriver:
    """Steps a shim at absolute deadlines of the running loop's clock.

    Args:
        shim: what is stepped.
        speed: simulated seconds per second of the loop.
        deliver: takes what clients receive, one MAVLink message per call.
        room: the room's cameras, and who receives their frames; None if there are none.
        faults: what the links do to packets.  They act at the client's end of each link: on what
            it would receive now, and on what it sends now.
    """

    def __init__(
        self,
        shim: Shim,
        *,
        speed: float,
        deliver: Deliver,
        room: tuple[MocapCamera, Callable[[bytes], None]] | None = None,
        faults: LinkFaults | None = None,
    ) -> None:
        self._room = room
        faults = faults or LinkFaults()
        self._telemetry, self._setpoints = faults.telemetry, faults.setpoints
        self._take = shim.receive if faults.setpoints is None else faults.setpoints.send
        self._arrival: asyncio.TimerHandle | None = None
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
            self._take(link, data, min(time_s, self._shim.time_s + TICK_S))

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
            if self._arrival is not None:
                self._arrival.cancel()
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
        if self._setpoints is not None:
            now_s = self._shim.time_s + TICK_S + _ROUNDING_S
            for due_s, link, data in self._setpoints.arrived(now_s):
                self._shim.receive(link, data, due_s)
        datagrams = self._shim.step()
        if self._room is not None:
            camera, receive = self._room
            frame = camera.look(self._shim.simulation.state)
            if frame is not None:
                loop.call_at(self._start + frame.due_s / self._speed, receive, frame.data)
        if self._telemetry is not None:
            _send(self._telemetry, datagrams)
            self._hand_over_arrivals(loop, self._telemetry)
            return
        if not datagrams:
            return
        # All that leaves at a tick arrives together.
        due_s = datagrams[0].due_s
        if due_s <= self._shim.time_s:
            self._hand_over(datagrams)
        else:
            loop.call_at(self._start + due_s / self._speed, self._hand_over, datagrams)

    def _hand_over(self, datagrams: Sequence[tuple[float, int, bytes]]) -> None:
        if self._loop is None:
            return
        deliver = self._deliver
        try:
            for _, link, data in datagrams:
                deliver(link, data)
        except Exception as error:
            self._fail(error)

    def _hand_over_arrivals(self, loop: asyncio.AbstractEventLoop, telemetry: LinkWay) -> None:
        """Hand over what has passed the faults by now, and set a timer for what comes next."""
        time_s = (loop.time() - self._start) * self._speed
        # After a long stall the boot clock does not catch up, and no more does babble.
        now_s = min(time_s, self._shim.time_s + _MOST_BEHIND_S) + _ROUNDING_S
        arrivals = telemetry.arrived(now_s)
        if arrivals:
            self._hand_over(arrivals)
        next_s = telemetry.next_s
        if self._arrival is not None:
            self._arrival.cancel()
            self._arrival = None
        # What is late already, as time goes on after a stall, waits for the next tick.
        if time_s < next_s < inf:
            when = self._start + next_s / self._speed
            self._arrival = loop.call_at(when, self._hand_over_arrivals, loop, telemetry)


def _send(telemetry: LinkWay, datagrams: Sequence[Datagram]) -> None:
    """Send what leaves at a tick on its way; the truth is not of the link, and passes by."""
    for due_s, link, data in datagrams:
        if data[_COMPONENT_AT] == TRUTH_COMPONENT_ID and data[0] == _MAVLINK_2:
            telemetry.pass_by(link, data, due_s)
        else:
            telemetry.send(link, data, due_s)
