"""The stages in the air: take off, let the controller take over, follow the reference."""

import asyncio
import math

import numpy as np

from companion.flight.assemble import fence_infeasibilities, supervisor_limits
from companion.flight.errors import FlightAbortedError, FlightRefusedError, HandedOverError
from companion.flight.setpoints.placement import PlacedTrajectory, Placement, place
from companion.flight.setpoints.timeline import SHORTEST_MOVE_S, Timeline, plan_timeline
from companion.flight.stages.crew import Flight, FlightScope
from companion.flight.stages.ground_stream import risen_without_satellites
from companion.flight.stages.readiness import last_texts
from companion.flight.vehicle.reports import LANDED_IN_AIR, LANDED_TAKING_OFF
from companion.frames import yaw_of
from companion.mavlink.exchange import Verdict
from companion.vehicle_state import VehicleState

_SHORTEST_APPROACH_S = {FlightScope.WHOLE: SHORTEST_MOVE_S, FlightScope.AIRBORNE: 0.2}
_ENOUGH_OF_HEIGHT = 0.85
"""Where the mode does not tell that the take-off is over, the height must, beside landed_state."""
_RISES_AFTER_S = 1.0
_FLOWS_AFTER_S = 1.0
"""A sample that can be flown on comes within a hundredth of this, if any does."""
_SETTLE_S = 0.2
"""In the air until the truth of the last scored sample has come, too."""


async def take_off(flight: Flight) -> None:
    """Take off by the autopilot, until it holds.

    Raises:
        FlightAbortedError: it was refused, or did not come to its end.
    """
    connection, mission = flight.connection, flight.mission
    dialect, height_m = connection.dialect, flight.settings.takeoff_height_m
    begins_in, holds_in = dialect.takeoff_modes[0], dialect.takeoff_modes[-1]
    flight.authority.expect(connection.mode, *dialect.takeoff_modes)
    flight.voice.phase("take off", "by the autopilot")
    exchange = await flight.backend.take_off(height_m)
    if exchange.verdict is not Verdict.ACCEPTED and not await _rises(flight):
        raise FlightAbortedError(
            f"Take-off was refused: {exchange.explanation}.{last_texts(flight)}"
        )

    def risen() -> bool:
        return (
            connection.reports.landed_state == LANDED_IN_AIR
            and connection.mode == holds_in
            and (begins_in != holds_in or _height_m(flight) > _ENOUGH_OF_HEIGHT * height_m)
        )

    await connection.waiting.until(
        lambda: connection.mode == begins_in or risen(),
        mission.timeouts.command_s,
        lambda: f"The autopilot accepted the take-off but stays in mode {connection.mode}.",
    )
    flight.authority.expect(*dialect.takeoff_modes)
    # An idle stream that armed it must not flow on: back in its mode the vehicle would fall.
    flight.stream.stop()
    await connection.waiting.until(
        lambda: risen() or risen_without_satellites(flight, height_m),
        connection.loop_seconds(mission.timeouts.takeoff_s),
        lambda: (
            f"The take-off did not end within {mission.timeouts.takeoff_s:g} s "
            f"(mode {connection.mode}, landed state {connection.reports.landed_state}, "
            f"{_height_m(flight):.1f} m above the ground)."
        ),
    )


async def _rises(flight: Flight) -> bool:
    """It takes off all the same: what was lost was the answer, and who flies refuses another."""
    connection = flight.connection
    try:
        await connection.waiting.until(
            lambda: connection.reports.landed_state in (LANDED_IN_AIR, LANDED_TAKING_OFF),
            connection.loop_seconds(_RISES_AFTER_S),
            lambda: "",
        )
    except FlightAbortedError as error:
        if type(error) is not FlightAbortedError or connection.waiting.failure is not None:
            raise
        return False
    return True


def _height_m(flight: Flight) -> float:
    """Above the ground that the vehicle stood on."""
    state = flight.connection.state
    assert state is not None
    return state.position_enu_m[2] - flight.progress.ground_up_m


async def engage(flight: Flight) -> Timeline:
    """Stream first, then ask for the mode, then let the controller take over.

    Raises:
        FlightAbortedError: the autopilot does not take setpoints, or not such as the companion can
            make, or the trajectory as the vehicle points leaves the geofence.
        HandedOverError: the same of setpoints, when others have flown the vehicle meanwhile.
    """
    if flight.scope is FlightScope.WHOLE:  # nobody else is at a simulated one in the air
        await _look_again(flight)
    connection, stream, mission = flight.connection, flight.stream, flight.mission
    placement = _settled_placement(flight)
    mode = connection.dialect.setpoint_mode
    stream.start()
    flight.authority.expect(connection.mode, mode, streaming=True)
    flight.voice.phase("engage", f"mode {mode}")
    await connection.waiting.pause(connection.loop_seconds(connection.dialect.stream_before_mode_s))
    await _flowing(flight)
    if flight.experiment is not None:
        flight.experiment.before_engaging()
    if connection.mode != mode:
        change = await connection.exchanges.change_mode(connection.target, mode)
        if change.verdict is not Verdict.ACCEPTED:
            stream.stop()
            raise FlightAbortedError(
                f"The autopilot does not take setpoints: {change.explanation}.{last_texts(flight)}"
            )
    flight.authority.expect(mode, streaming=True)
    state = connection.state
    assert state is not None
    position = np.array(state.position_enu_m)
    progress = flight.progress
    if not np.isfinite(progress.home_m).all():
        progress.home_m = position
    timeline = plan_timeline(
        PlacedTrajectory(flight.trajectory, placement),
        start_s=state.time_s,
        from_m=position,
        home_m=progress.home_m,
        hover_s=mission.hover_s,
        speed_m_s=mission.approach_speed_m_s,
        shortest_approach_s=_SHORTEST_APPROACH_S[flight.scope],
    )
    along_x = flight.yaw.desired == "zero"
    heading = placement.heading_rad if along_x else yaw_of(state.attitude_flu_to_enu)
    stream.engage(timeline, heading, placement.anchor_enu_m)
    progress.timeline = timeline
    progress.completed = False
    return timeline


async def _flowing(flight: Flight) -> None:
    """Setpoints flow: the state that comes can be flown on.

    Raises:
        FlightAbortedError: they don't.
        HandedOverError: the same, when others have flown the vehicle meanwhile: they go on.
    """
    stream, waiting = flight.stream, flight.connection.waiting
    resumed = flight.progress.timeline is not None
    try:
        await waiting.until(
            lambda: stream.flows,
            _FLOWS_AFTER_S,
            lambda: "the state of the vehicle that arrives cannot be flown on",
        )
    except FlightAbortedError as error:
        if type(error) is not FlightAbortedError or waiting.failure is not None:
            raise
        stream.stop()
        if resumed:
            raise HandedOverError(f"not resumed: {error}") from error
        raise


async def _look_again(flight: Flight) -> None:
    """What the setpoints mean may have been changed since it was read.

    Raises:
        FlightAbortedError: to what cannot be flown.
        HandedOverError: the same, or there is no state to fly on, or the vehicle is outside the
            geofence, when others have flown it meanwhile: they go on.
    """
    now_s = asyncio.get_running_loop().time()
    if flight.authority.handed_over and not flight.connection.samples.arriving(now_s):
        raise HandedOverError("not resumed: no usable state of the vehicle arrives")
    try:
        await flight.settings.read_again()
    except FlightRefusedError as error:
        if flight.authority.handed_over:
            raise HandedOverError(f"not resumed: {error}".rstrip(".")) from error
        raise FlightAbortedError(str(error)) from error
    outside = outside_geofence(flight)
    if flight.authority.handed_over and outside:
        raise HandedOverError(f"not resumed: {outside}")


def outside_geofence(flight: Flight) -> str:
    """How far outside the vehicle is, and the remedy; empty if it is not, or nobody can say.

    The ladder would give it up again as soon as it was taken.
    """
    connection, placement = flight.connection, flight.progress.placement
    state = connection.state
    arriving = connection.samples.arriving(asyncio.get_running_loop().time())
    if placement is None or state is None or not arriving:
        return ""
    limits = supervisor_limits(flight.mission).about(placement.anchor_enu_m)
    breach = limits.breach(state.position_enu_m)
    return f"{breach}; fly it inside first" if breach else ""


def _settled_placement(flight: Flight) -> Placement:
    """Where the mission lies: settled now if this is its first engagement.

    Raises:
        FlightAbortedError: the trajectory as the vehicle points leaves the geofence.
    """
    progress, state = flight.progress, flight.connection.state
    assert state is not None
    if progress.placement is None:
        east, north, _ = state.position_enu_m
        ground = progress.ground_up_m
        takeoff = (east, north, ground) if math.isfinite(ground) else None
        yaw = yaw_of(state.attitude_flu_to_enu)
        placement = place(flight.mission.origin, takeoff, yaw)
        problems = fence_infeasibilities(flight.trajectory, flight.mission, placement)
        if problems:
            raise FlightAbortedError(" ".join(problems))
        progress.placement = placement
    return progress.placement


async def track(flight: Flight, timeline: Timeline) -> None:
    """Follow the timeline to its end, or as far as the flight's scope goes."""
    connection = flight.connection
    scored_until_s = timeline.scored_s[1]
    phase = ""
    looked_at: VehicleState | None = None

    def over() -> bool:
        nonlocal phase, looked_at
        state = connection.state
        if state is None or state is looked_at:
            return False  # one that was looked at already has not ended the wait
        looked_at = state
        now_in = timeline.phase(state.time_s)
        if now_in != phase:
            phase = now_in
            flight.voice.phase(phase)
        if state.time_s >= scored_until_s:
            flight.progress.completed = True
        if flight.scope is FlightScope.AIRBORNE:
            return state.time_s >= scored_until_s + _SETTLE_S
        return timeline.finished(state.time_s)

    await connection.waiting.until(over, None, lambda: "")
