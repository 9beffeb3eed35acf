"""Arming, take-off and landing through MAVSDK 4 (https://mavsdk.mavlink.io, `mavsdk.asyncio`).

It is a client of the shared link like any other: it sits at an endpoint of its own on loopback, and
what it commands passes the filter only while the flight waits for just that.  Setpoints are never
MAVSDK's: it repeats the last one for as long as its process lives.
"""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from companion.config.link_models import ForwardConfig
from companion.flight.errors import FlightAbortedError
from companion.flight.shared_link.endpoints import Endpoint
from companion.flight.vehicle.connection import Connection
from companion.mavlink.exchange import Verdict

_COMPONENT = 195
"""MAV_COMP_ID_PATHPLANNER, as MAVSDK calls itself by default."""
_LOOK_S = 0.1
_LONGEST_S = 60.0
"""No action of MAVSDK's takes this long by its own patience."""
_MODE_FOLLOWS_S = 3.0


@dataclass(frozen=True, slots=True)
class MavsdkAnswer:
    """How an action of MAVSDK's ended."""

    verdict: Verdict
    explanation: str


class MavsdkMission:
    """A `MissionBackend` that is MAVSDK."""

    endpoints = (ForwardConfig(url="udpin://127.0.0.1:0"),)

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._endpoint: Endpoint | None = None
        self._mavsdk: Any = None
        self._action: Any = None
        self._telemetry: Any = None

    def attach(self, endpoint: Endpoint) -> None:
        """Take the endpoint, which is open now."""
        self._endpoint = endpoint

    async def become_ready(self, timeout_s: float) -> None:
        """Connect MAVSDK, and wait until its health check is content.

        Raises:
            FlightAbortedError: it does not find the vehicle, or stays discontent.
        """
        if self._action is None:
            await self._connect(timeout_s)
        healthy = False

        async def look() -> None:
            nonlocal healthy
            while not healthy:
                healthy = await self._telemetry.health_all_ok()
                self._connection.waiting.wake()
                await asyncio.sleep(_LOOK_S)

        looking = asyncio.get_running_loop().create_task(look())
        try:
            await self._connection.waiting.until(
                lambda: healthy,
                timeout_s,
                lambda: (
                    f"MAVSDK's health check was not content within {timeout_s:g} s. It wants "
                    "calibrated sensors, a local and a global position, a home position and the "
                    "autopilot's consent to arm; link.mission_backend: companion does without it."
                ),
            )
        finally:
            looking.cancel()
            await asyncio.gather(looking, return_exceptions=True)

    async def arm(self) -> MavsdkAnswer:
        """MAVSDK's arm."""
        reports = self._connection.reports
        before = reports.armed
        return await self._do("arm", self._action.arm, lambda: reports.armed and not before)

    async def take_off(self, height_m: float) -> MavsdkAnswer:
        """MAVSDK's take-off; the height is the autopilot's own parameter on PX4."""
        if self._connection.dialect.name == "ardupilot":
            answer = await self._do("take-off height", lambda: self._set_height(height_m))
            if answer.verdict is not Verdict.ACCEPTED:
                return answer
        return await self._do("take-off", self._action.takeoff)

    async def land(self) -> MavsdkAnswer:
        """MAVSDK's land, and the vehicle's report that it does."""
        answer = await self._do("land", self._action.land)
        if answer.verdict is not Verdict.ACCEPTED:
            return answer
        connection = self._connection
        try:
            await connection.waiting.until(
                lambda: connection.mode == "land", _MODE_FOLLOWS_S, lambda: ""
            )
        except FlightAbortedError:
            if connection.waiting.failure is not None:
                raise
            return MavsdkAnswer(
                Verdict.TIMED_OUT,
                f"MAVSDK's land was acknowledged, and the mode stayed {connection.mode}",
            )
        return answer

    async def close(self) -> None:
        """End MAVSDK and its threads."""
        mavsdk, self._mavsdk = self._mavsdk, None
        self._action = self._telemetry = None
        if mavsdk is not None:
            await asyncio.get_running_loop().run_in_executor(None, mavsdk.destroy)

    async def _set_height(self, height_m: float) -> None:
        await self._action.set_takeoff_altitude(height_m)

    async def _connect(self, timeout_s: float) -> None:
        from mavsdk.asyncio import Configuration, Mavsdk  # type: ignore[import-untyped]
        from mavsdk.asyncio.plugins.action import ActionAsync  # type: ignore[import-untyped]
        from mavsdk.asyncio.plugins.telemetry import TelemetryAsync  # type: ignore[import-untyped]
        from mavsdk.logging import log_subscribe  # type: ignore[import-untyped]

        log_subscribe(lambda *_: True)  # else it prints for itself

        assert self._endpoint is not None
        port = self._endpoint.local_port
        configuration = Configuration.create_manual(
            self._connection.our_system_id, _COMPONENT, True
        )
        self._mavsdk = Mavsdk(configuration)
        await self._mavsdk.add_any_connection(f"udpout://127.0.0.1:{port}")
        system: Any = None

        async def look() -> None:
            nonlocal system
            while system is None:
                for found in await self._mavsdk.get_systems():
                    wanted = self._connection.target.system_id
                    if await found.get_system_id() == wanted and await found.has_autopilot():
                        system = found
                self._connection.waiting.wake()
                await asyncio.sleep(_LOOK_S)

        looking = asyncio.get_running_loop().create_task(look())
        try:
            await self._connection.waiting.until(
                lambda: system is not None,
                timeout_s,
                lambda: (
                    f"MAVSDK did not find the vehicle within {timeout_s:g} s at UDP port {port}."
                ),
            )
        finally:
            looking.cancel()
            await asyncio.gather(looking, return_exceptions=True)
        self._action, self._telemetry = ActionAsync(system), TelemetryAsync(system)

    async def _do(
        self,
        name: str,
        begin: Callable[[], Awaitable[None]],
        done: Callable[[], bool] = lambda: False,
    ) -> MavsdkAnswer:
        """Let MAVSDK do something, for as long as the flight waits for it.

        Args:
            name: of what it does, for a person.
            begin: begins it.
            done: true once the vehicle is seen to have done it: from then on nothing that MAVSDK
                still repeats reaches the vehicle, and whatever MAVSDK says it counts as accepted.

        Raises:
            FlightAbortedError: the wait was ended from outside; what MAVSDK still repeats is kept
                back then.
        """
        assert self._endpoint is not None
        connection = self._connection
        connection.waiting.check()
        self._endpoint.trusted = True
        doing = asyncio.ensure_future(begin())
        doing.add_done_callback(lambda _: connection.waiting.wake())
        seen = False
        try:
            for over in (lambda: doing.done() or done(), doing.done):
                await connection.waiting.until(
                    over, _LONGEST_S, lambda: f"MAVSDK's {name} did not come to an end"
                )
                seen = seen or done()
                self._endpoint.trusted = False
        finally:
            self._endpoint.trusted = False
            if not doing.done():
                doing.cancel()
        error = doing.exception()
        if error is None or seen:
            return MavsdkAnswer(Verdict.ACCEPTED, f"MAVSDK's {name} accepted")
        result = getattr(getattr(error, "result", None), "name", "")
        if not result:
            raise error
        verdict = Verdict.TIMED_OUT if result == "TIMEOUT" else Verdict.REFUSED
        said = result.lower().replace("_", " ")
        return MavsdkAnswer(verdict, f"MAVSDK's {name} ended with: {said}")
