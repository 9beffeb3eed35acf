"""Motion capture beside a flight: poses to the autopilot, and what is done when they stop.

Before arming, a stream that does not run refuses the flight.  In flight its loss lands the vehicle,
by the autopilot: its estimator goes on with inertial sensors alone, which is good for a few seconds
of landing (PX4 says its position is lost after EKF2_NOAID_TOUT, 5 s, and then descends without
one), and for nothing else.  To hand over would be worse: PX4's failsafe for a stream that stops
holds a position, which nobody measures any more.

Poses that jump in flight are such a loss: they are not passed on, as nobody can tell which of the
two places is the true one.
"""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable

from companion.config.mocap_models import MocapConfig
from companion.flight.errors import FlightAbortedError, FlightRefusedError
from companion.flight.vehicle.connection import Connection
from companion.flight.vehicle.reports import LANDED_IN_AIR, LANDED_TAKEOFF, Reports
from companion.mavlink.messages import Outgoing
from companion.mocap.bridge import MocapBridge
from companion.mocap.sources import open_source

_LIFTS_WITHIN_S = 2.0
"""After an autopilot says that it takes off, its rotors first have to come up to speed."""


class _SurelyOff:
    """Tells whether a vehicle has been in the air for a while and is not about to touch down."""

    def __init__(self, reports: Reports) -> None:
        self._reports = reports
        self._since_s: float | None = None

    def __call__(self) -> bool:
        reports, now_s = self._reports, asyncio.get_running_loop().time()
        if not reports.armed or reports.landed_state not in (LANDED_IN_AIR, LANDED_TAKEOFF):
            self._since_s = None
            return False
        if self._since_s is None:
            self._since_s = now_s
        return now_s - self._since_s > _LIFTS_WITHIN_S


class MotionCapture:
    """The stream of poses, as a flight sees it.

    Args:
        bridge: takes the poses and makes the messages.
        source: where they come from, for a person.
        port: the UDP port that is listened on; 0 if none is.
        trouble: why none can come any more; empty as long as one can.
    """

    def __init__(
        self,
        bridge: MocapBridge,
        source: str,
        *,
        port: int = 0,
        trouble: Callable[[], str] = lambda: "",
    ) -> None:
        self.bridge = bridge
        self.source = source
        self.port = port
        self._trouble = trouble

    async def run(self, connection: Connection, tell: Callable[[str, str], None]) -> None:
        """Send poses as soon as there is a vehicle, until cancelled.

        Args:
            connection: to the autopilot.
            tell: takes severity and text for a person.
        """
        reports = connection.reports
        self.bridge.on_lost = connection.waiting.wake
        self.bridge.armed = lambda: reports.armed
        self.bridge.in_air = _SurelyOff(reports)

        def send(outgoing: Outgoing) -> None:
            if connection.peers.vehicle is not None:
                connection.send(outgoing)

        await self.bridge.run(send, tell)

    async def wait_for_poses(self, connection: Connection, wait_s: float) -> None:
        """Wait until poses come in.

        Raises:
            FlightAbortedError: none did; the text says what came instead.
        """
        loop = asyncio.get_running_loop()
        await connection.waiting.until(
            lambda: self.bridge.alive(loop.time()) or bool(self._trouble()),
            wait_s,
            lambda: self._nothing(f"within {wait_s:g} s"),
        )
        if not self.bridge.alive(loop.time()):
            raise FlightAbortedError(self._nothing("from the beginning"))

    def check(self) -> None:
        """Make sure that poses come in, for the moment before arming.

        Raises:
            FlightRefusedError: they do not.
        """
        if self._lost():
            raise FlightRefusedError(
                self._nothing(f"for {self.bridge.config.timeout_s:g} s") + " Nothing was armed."
            )

    def fault(self) -> FlightAbortedError | None:
        """What ends the flight by a landing; None while poses come in."""
        if not self._lost():
            return None
        return FlightAbortedError(
            self._nothing(f"for {self.bridge.config.timeout_s:g} s")
            + " The autopilot does not know its position for long without them."
        )

    def _lost(self) -> bool:
        return not self.bridge.alive(asyncio.get_running_loop().time())

    def _nothing(self, since: str) -> str:
        trouble = self._trouble() or self.bridge.trouble
        return (
            f"No usable pose of '{self.bridge.config.body}' came {since} from {self.source} "
            f"({self.bridge.describe()})." + (f" {trouble}." if trouble else "")
        )


@contextlib.asynccontextmanager
async def motion_capture(config: MocapConfig | None) -> AsyncIterator[MotionCapture | None]:
    """Open the source of a mission's poses; None for a mission without.

    Raises:
        MocapError: it can't be opened.
    """
    if config is None:
        yield None
        return
    bridge = MocapBridge(config)
    source = await open_source(config, bridge.receive)
    try:
        yield MotionCapture(
            bridge, source.description, port=source.port, trouble=lambda: source.trouble
        )
    finally:
        await source.close()
