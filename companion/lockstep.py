"""Joins companion and shim by byte pipes on one virtual clock.

The one module that may import both sides, and of the shim only its lockstep entry.  The same code
as in real time runs here, and the same MAVLink bytes pass; only sockets and waiting are gone.
"""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np

from companion.config.resolve import FlightConfig
from companion.control.qp.port import QpSolverFactory
from companion.flight.check.checking import Checked, CheckOrder, Tell, check_vehicle
from companion.flight.clock import run_in_virtual_time
from companion.flight.conduct import Outcome, conduct
from companion.flight.errors import ShimRefusedError
from companion.flight.experiment import Experiment
from companion.flight.inbox import Inbox
from companion.flight.motion_capture import MotionCapture
from companion.flight.observer import Observer
from companion.flight.own_parts import OwnController
from companion.flight.setpoints.placement import PlacedTrajectory, place
from companion.flight.shim_process import ShimOptions, with_state_rate
from companion.flight.signals import commands_by_signal
from companion.flight.stages.crew import FlightScope
from companion.frames import Vector3
from companion.link.memory import MemoryLink
from companion.mavlink.signing import Signing
from companion.mocap.bridge import MocapBridge
from companion.recording.flight_log import FlightLog
from companion.trajectories.trajectory import Trajectory
from sitl_shim import lockstep as shim_lockstep

_BOOT_UNIX_S = datetime(2020, 1, 1, tzinfo=UTC).timestamp()
"""When simulated time begins, as the logs and the shim have it."""

Aftermath = Callable[[bytes, float], bool]
"""Told each datagram from the shim, with the loop's time, once the companion is gone; True when it
has seen enough."""

OwnWind = Callable[[float, Vector3], Vector3]
"""Velocity of the air (ENU, m/s) at a time (s since the vehicle's boot) and a place (ENU, m)."""

Tap = Callable[[bytes], bytes]
"""Takes a datagram on its way and gives what arrives in its place; the loop's clock is running."""


def fly_in_lockstep(
    config: FlightConfig,
    trajectory: Trajectory,
    log: FlightLog,
    observer: Observer,
    shim: ShimOptions,
    *,
    inbox: Inbox | None = None,
    from_shim: Tap | None = None,
    to_shim: Tap | None = None,
    make_solver: QpSolverFactory | None = None,
    airborne: bool = False,
    signing_key: bytes | None = None,
    from_cameras: Tap | None = None,
    experiment: Experiment | None = None,
    aftermath: Aftermath | None = None,
    aftermath_s: float = 30.0,
    own: OwnController | None = None,
    own_wind: OwnWind | None = None,
    replayable: bool = True,
) -> Outcome:
    """Fly the embedded shim in simulated time, as fast as the processor allows.

    Args:
        config: mission, vehicle, controller.
        trajectory: what to track.
        log: open; closed by the caller.
        observer: told what happens.
        shim: which vehicle flies in which wind.
        inbox: a person's commands; an empty one by default.
        from_shim: may change each datagram to the companion; an empty one is lost.
        to_shim: the same for the other way.
        make_solver: a QP solver in place of the configured one.
        airborne: begin armed and holding at the trajectory's first point, and end in the air as
            soon as the scored part is over, with the outcome ``tracked``.  For studies of many
            flights: it saves take-off, approach, return and landing.
        signing_key: 32 bytes, of companion and shim; None: packets are not signed.
        from_cameras: may change each datagram of the room's cameras, which look if the mission
            has motion capture; an empty one is lost.
        experiment: flown in the place of the controller; None: the controller flies.
        aftermath: goes on watching the vehicle when the companion has ended its flight, and says
            nothing to it; None: all ends at once.
        aftermath_s: for at most this long.
        own: a controller of one's own, in the place of the configured one.
        own_wind: blows beside the scenario's wind; asked every 4 ms, at times that never go back.
        replayable: False if the trajectory is in no file.

    Raises:
        ShimRefusedError: the shim can't simulate what it was asked for.
        Exception: whatever `own_wind` raises.
    """
    first = _first_point(config, trajectory) if airborne else None
    mocap = _motion_capture(config)

    async def fly() -> Outcome:
        on_frame = None if mocap is None else _cameras(mocap, from_cameras)
        async with _embedded(
            config, shim, signing_key, from_shim, to_shim, first, on_frame, own_wind
        ) as way:
            asked = Inbox() if inbox is None else inbox
            with commands_by_signal(asked, observer):
                outcome = await conduct(
                    config,
                    trajectory,
                    way.link,
                    log,
                    asked,
                    observer,
                    real_time=False,
                    make_solver=make_solver,
                    scope=FlightScope.AIRBORNE if airborne else FlightScope.WHOLE,
                    signing=way.signing,
                    mocap=mocap,
                    experiment=experiment,
                    own=own,
                    replayable=replayable,
                )
            if aftermath is not None:
                await _watch(way.link, aftermath, aftermath_s)
            return outcome

    return run_in_virtual_time(fly())


def check_in_lockstep(
    order: CheckOrder,
    tell: Tell,
    shim: ShimOptions,
    *,
    from_shim: Tap | None = None,
    to_shim: Tap | None = None,
    signing_key: bytes | None = None,
) -> Checked:
    """Check the embedded shim in simulated time.

    Args:
        order: what to check.
        tell: told severity and text of what is set and restored.
        shim: which vehicle.
        from_shim: may change each datagram to the companion; an empty one is lost.
        to_shim: the same for the other way.
        signing_key: 32 bytes, of companion and shim; None: packets are not signed.

    Raises:
        ShimRefusedError: the shim can't simulate what it was asked for.
    """

    async def check() -> Checked:
        async with _embedded(order.config, shim, signing_key, from_shim, to_shim) as way:
            return await check_vehicle(order, way.link, tell, signing=way.signing)

    return run_in_virtual_time(check())


async def _watch(link: MemoryLink, aftermath: Aftermath, longest_s: float) -> None:
    """Listen to a vehicle that is left alone."""
    seen_enough = asyncio.Event()

    def take(data: bytes, time_s: float) -> None:
        if aftermath(data, time_s):
            seen_enough.set()

    link.on_bytes = take
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(seen_enough.wait(), longest_s)


def _motion_capture(config: FlightConfig) -> MotionCapture | None:
    """The bridge for the cameras of the simulated room."""
    if config.mission.mocap is None:
        return None
    return MotionCapture(MocapBridge(config.mission.mocap), "the simulated room")


def _cameras(mocap: MotionCapture, tap: Tap | None) -> Callable[[bytes], None]:
    """Takes the frames of the room's cameras to the bridge."""
    time_s = asyncio.get_running_loop().time

    def take(data: bytes) -> None:
        arriving = data if tap is None else tap(data)
        if arriving:
            mocap.bridge.receive(arriving, time_s())

    return take


class _Way(NamedTuple):
    """The way to an embedded shim that runs."""

    link: MemoryLink
    signing: Signing | None


@contextlib.asynccontextmanager
async def _embedded(
    config: FlightConfig,
    options: ShimOptions,
    signing_key: bytes | None,
    from_shim: Tap | None,
    to_shim: Tap | None,
    airborne_at_enu_m: tuple[float, float, float] | None = None,
    on_frame: Callable[[bytes], None] | None = None,
    own_wind: OwnWind | None = None,
) -> AsyncIterator[_Way]:
    """Run a shim, with an open link to it.

    Raises:
        ShimRefusedError: it can't simulate what it was asked for.
    """

    def to_vehicle(data: bytes) -> None:
        shim.receive(data)

    link = MemoryLink(_tapped(to_vehicle, to_shim), "the embedded shim, in lockstep")
    options = with_state_rate(options, config.mission.state_rate_hz)
    try:
        shim = shim_lockstep.LockstepShim(
            shim_lockstep.ShimOptions(
                autopilot=options.autopilot,
                vehicle=options.vehicle,
                scenario=options.scenario,
                seed=options.seed,
                speed=options.speed,
                sensors=options.sensors,
                parameters=dict(options.parameters),
                boot_scale=options.boot_scale,
                faults=options.faults,
                signing_key=options.signing_key,
                airborne_at_enu_m=airborne_at_enu_m,
                own_wind=own_wind,
            ),
            _tapped(link.receive, from_shim),
            on_frame=on_frame,
        )
    except ValueError as error:
        raise ShimRefusedError(str(error)) from error
    await link.open()
    loop = asyncio.get_running_loop()
    signing = None
    if signing_key is not None:
        link_config = config.mission.link.signing
        link_id = 0 if link_config is None else link_config.link_id
        signing = Signing(signing_key, lambda: _BOOT_UNIX_S + loop.time(), link_id)
    flying_shim = asyncio.get_running_loop().create_task(shim.run())
    try:
        yield _Way(link, signing)
    finally:
        link.close()
        flying_shim.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await flying_shim


def _tapped(deliver: Callable[[bytes], None], tap: Tap | None) -> Callable[[bytes], None]:
    """Delivers what a tap leaves of a datagram; without one all, as it is."""
    if tap is None:
        return deliver

    def through(data: bytes) -> None:
        arriving = tap(data)
        if arriving:
            deliver(arriving)

    return through


def _first_point(config: FlightConfig, trajectory: Trajectory) -> tuple[float, float, float]:
    """Where the trajectory begins in the autopilot's local frame, ENU m."""
    placed = PlacedTrajectory(trajectory, place(config.mission.origin, None, 0.0))
    east, north, up = placed.position(np.zeros(1))[0]
    return float(east), float(north), float(up)
