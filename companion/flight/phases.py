"""The phases of a flight, in order: connect, ready, arm, take off, engage, fly, land.

Before the vehicle is armed whatever is wrong refuses the flight; from then on it aborts it, and the
vehicle is landed or left to the autopilot's own failsafe.
"""

import asyncio
import math
from dataclasses import dataclass

import numpy as np

from companion.config.models import MissionConfig, YawConfig
from companion.flight.connection import Connection
from companion.flight.errors import FlightAbortedError, FlightRefusedError, LinkLostError
from companion.flight.inbox import Inbox, PilotCommand
from companion.flight.observer import Observer
from companion.flight.setpoint_stream import SetpointStream, heading_of
from companion.flight.timeline import Timeline, plan_timeline
from companion.mavlink.commands import arm
from companion.mavlink.exchange import Verdict
from companion.trajectories.trajectory import Trajectory

LANDED_ON_GROUND = 1
LANDED_IN_AIR = 2
_RATE_MEASURED_S = 1.0
_SLOWEST_STATE_HZ = 30.0
_RATE_WARNING = 0.7


@dataclass(frozen=True, slots=True)
class Ending:
    """How a flight that left the ground ended."""

    landed: bool
    """The vehicle is on the ground and disarmed, by the companion's landing."""
    completed: bool
    """The trajectory was flown to its end."""
    note: str
    """One sentence for a person; empty if all went as planned."""
    timeline: Timeline | None
    """The reference of the last (or only) run over the trajectory."""


@dataclass(frozen=True, slots=True)
class Flight:
    """What the phases work with."""

    mission: MissionConfig
    yaw: YawConfig
    trajectory: Trajectory
    connection: Connection
    stream: SetpointStream
    inbox: Inbox
    observer: Observer


async def fly(flight: Flight) -> Ending:
    """Fly the mission from connecting to landing.

    Raises:
        FlightRefusedError: nothing was armed.
        FlightAbortedError: the flight ended otherwise than by landing; the text says how.
    """
    connection, inbox = flight.connection, flight.inbox
    inbox.on_put = lambda command: _on_command(flight, command)
    connection.interrupted = lambda: (
        FlightRefusedError("Stopped by command before arming.") if inbox.waiting else None
    )
    try:
        await _connect(flight)
        await _become_ready(flight)
        connection.interrupted = lambda: None
        await _arm(flight)
    except FlightAbortedError as error:
        if isinstance(error, LinkLostError):
            raise
        raise FlightRefusedError(str(error)) from error
    return await _fly_armed(flight)


def _on_command(flight: Flight, command: PilotCommand) -> None:
    """An abort takes effect at once, whatever the flight waits for; the rest at its next step."""
    if command is PilotCommand.ABORT:
        flight.stream.stop("aborted by command")
    flight.connection.wake()


async def _connect(flight: Flight) -> None:
    connection, mission = flight.connection, flight.mission
    flight.observer.phase("connect", connection.link_description)
    await connection.wait_until(
        lambda: connection.peers.vehicle is not None,
        mission.timeouts.connect_s,
        lambda: (
            f"No HEARTBEAT of an autopilot came over {connection.link_description} within "
            f"{mission.timeouts.connect_s:g} s. Check that the vehicle is on and sends to this "
            "address (PX4's onboard link sends to UDP port 14540), or give --connect."
        ),
    )
    vehicle = connection.peers.vehicle
    assert vehicle is not None
    if vehicle.autopilot != connection.dialect.autopilot_id:
        raise FlightRefusedError(
            f"The autopilot on {connection.link_description} has MAV_AUTOPILOT "
            f"{vehicle.autopilot}; {connection.dialect.name} has "
            f"{connection.dialect.autopilot_id}. Give the right --autopilot."
        )
    if connection.reports.armed:
        raise FlightRefusedError(
            f"The vehicle is armed already (mode {connection.mode}). The companion takes over no "
            "flight that it did not start: land and disarm, then start again."
        )
    await connection.request_streams(mission.state_rate_hz)
    await connection.wait_until(
        lambda: connection.clock.valid and connection.state is not None,
        mission.timeouts.connect_s,
        lambda: (
            f"The autopilot answers, but within {mission.timeouts.connect_s:g} s there came "
            + ("no ODOMETRY" if connection.state is None else "no answer to TIMESYNC")
            + ". Check the link's direction and that the estimator has a position."
        ),
    )
    await _measure_rate(flight)


async def _measure_rate(flight: Flight) -> None:
    """Streams are asked for, then measured: what an autopilot grants is not what it sends."""
    connection = flight.connection
    first = connection.state
    assert first is not None
    count_before = connection.samples
    await asyncio.sleep(_RATE_MEASURED_S)
    last = connection.state
    assert last is not None
    span = last.time_s - first.time_s
    rate = (connection.samples - count_before) / span if span > 0.0 else 0.0
    wanted = flight.mission.state_rate_hz
    if rate < _SLOWEST_STATE_HZ:
        raise FlightRefusedError(
            f"The state arrives at {rate:.0f} Hz; at least {_SLOWEST_STATE_HZ:g} Hz are needed "
            f"({wanted:g} Hz were asked for). Use a faster link or fewer streams on it."
        )
    if rate < _RATE_WARNING * wanted:
        flight.observer.message(
            "warning", f"the state arrives at {rate:.0f} Hz, {wanted:g} Hz were asked for"
        )
    flight.stream.punctuality.period_s = 1.0 / rate / max(0.1, connection.clock.rate)


async def _become_ready(flight: Flight) -> None:
    connection = flight.connection
    flight.observer.phase("ready", f"{connection.dialect.name}, mode {connection.mode}")
    await connection.wait_until(
        lambda: connection.readiness.ready,
        flight.mission.timeouts.ready_s,
        lambda: (
            f"The autopilot did not become ready within {flight.mission.timeouts.ready_s:g} s. "
            f"It waits for: {', '.join(connection.readiness.missing)}." + _last_texts(connection)
        ),
    )


async def _arm(flight: Flight) -> None:
    connection = flight.connection
    flight.observer.phase("arm", "")
    exchange = await connection.command(arm(connection.target))
    if exchange.verdict is not Verdict.ACCEPTED:
        raise FlightRefusedError(
            f"Arming was denied: {exchange.explanation}. Look at the autopilot's messages in a "
            "ground station and mend what they name." + _last_texts(connection)
        )
    await connection.wait_until(
        lambda: connection.reports.armed,
        flight.mission.timeouts.command_s,
        lambda: "The autopilot accepted to arm, but its HEARTBEAT never said armed.",
    )


async def _fly_armed(flight: Flight) -> Ending:
    """From armed to disarmed; every way out of here ends on the ground or with the autopilot."""
    stream, connection = flight.stream, flight.connection
    timeline: Timeline | None = None
    completed = False
    note = ""
    try:
        command = await _take_off(flight)
        while command is None:
            timeline = await _engage(flight)
            command, completed = await _track(flight, timeline)
            if command is None and not completed:
                note = stream.stopped_because
                command = await _wait_handed_over(flight, note)
                if command is PilotCommand.RESUME:
                    command = None
                    note = ""
            else:
                break
        if command is PilotCommand.ABORT:
            stream.stop()
            note = "aborted by command: " + connection.dialect.hand_over.explanation
            flight.observer.message("warning", note)
            await _wait_disarmed(flight)
            return Ending(False, completed, note, timeline)
        if command is PilotCommand.LAND:
            note = "landed early by command"
        landed = await _land(flight)
        return Ending(landed, completed, note, timeline)
    except _HandedOverError as handed:
        return Ending(False, completed, str(handed), timeline)
    except LinkLostError:
        stream.stop()
        raise
    except FlightAbortedError as error:
        flight.observer.message("error", str(error))
        landed = await _land(flight)
        where = "landed" if landed else f"left to the autopilot in mode {connection.mode}"
        raise FlightAbortedError(f"{error} The vehicle was {where}.") from error


class _HandedOverError(Exception):
    """The flight ended after a hand-over, with nobody asking for anything else."""


async def _take_off(flight: Flight) -> PilotCommand | None:
    connection, mission = flight.connection, flight.mission
    flight.observer.phase("take off", "by the autopilot")
    exchange = await connection.command(connection.dialect.takeoff(connection.target, math.nan))
    if exchange.verdict is not Verdict.ACCEPTED:
        raise FlightAbortedError(f"Take-off was refused: {exchange.explanation}.")

    def risen() -> bool:
        reports = connection.reports
        return reports.landed_state == LANDED_IN_AIR and connection.mode == "loiter"

    await connection.wait_until(
        lambda: connection.mode == "takeoff" or risen() or flight.inbox.waiting,
        mission.timeouts.command_s,
        lambda: f"The autopilot accepted the take-off but stays in mode {connection.mode}.",
    )
    await connection.wait_until(
        lambda: risen() or flight.inbox.waiting or not connection.reports.armed,
        mission.timeouts.takeoff_s,
        lambda: (
            f"The take-off did not end within {mission.timeouts.takeoff_s:g} s "
            f"(mode {connection.mode}, landed state {connection.reports.landed_state})."
        ),
    )
    if not connection.reports.armed:
        raise FlightAbortedError("The autopilot disarmed during the take-off.")
    return flight.inbox.take()


async def _engage(flight: Flight) -> Timeline:
    """Stream first, then ask for the mode, then let the controller take over."""
    connection, stream, mission = flight.connection, flight.stream, flight.mission
    dialect = connection.dialect
    flight.observer.phase("engage", f"mode {dialect.setpoint_mode}")
    stream.start()
    await asyncio.sleep(dialect.stream_before_mode_s / max(0.1, connection.clock.rate))
    change = await connection.change_mode(dialect.setpoint_mode)
    if change.verdict is not Verdict.ACCEPTED:
        stream.stop()
        raise FlightAbortedError(
            f"The autopilot does not take setpoints: {change.explanation}."
            + _last_texts(connection)
        )
    state = connection.state
    assert state is not None
    position = np.array(state.position_enu_m)
    timeline = plan_timeline(
        flight.trajectory,
        start_s=state.time_s,
        from_m=position,
        origin_m=np.array(mission.origin_enu_m),
        home_m=position,
        hover_s=mission.hover_s,
        speed_m_s=mission.approach_speed_m_s,
    )
    yaw = 0.0 if flight.yaw.desired == "zero" else heading_of(state)
    stream.control.engage(timeline, yaw)
    return timeline


async def _track(flight: Flight, timeline: Timeline) -> tuple[PilotCommand | None, bool]:
    """Follow the timeline; a person's command or None, and whether it was flown to its end."""
    connection, stream, inbox = flight.connection, flight.stream, flight.inbox
    setpoint_mode = connection.dialect.custom_mode(connection.dialect.setpoint_mode)
    phase = ""

    def taken_over(custom_mode: int) -> None:
        if custom_mode != setpoint_mode:
            name = connection.dialect.mode_name(custom_mode)
            flight.observer.message("warning", f"somebody changed the mode to {name}")
            stream.stop(f"somebody else changed the mode to {name}")

    def over() -> bool:
        nonlocal phase
        state = connection.state
        assert state is not None
        now_in = timeline.phase(state.time_s)
        if now_in != phase:
            phase = now_in
            flight.observer.phase(phase, "")
        return timeline.finished(state.time_s)

    connection.on_mode = taken_over
    stream.on_stop = connection.wake
    try:
        await connection.wait_until(
            lambda: over() or inbox.waiting or not stream.running, None, lambda: ""
        )
    finally:
        connection.on_mode = None
        stream.on_stop = None
    state = connection.state
    assert state is not None
    finished = stream.running and timeline.finished(state.time_s)
    scored_end = timeline.scored_s[1]
    if not stream.running and state.time_s < scored_end:
        return None, False
    command = inbox.take()
    if command is PilotCommand.RESUME:
        command = None
    return command, finished


async def _wait_handed_over(flight: Flight, reason: str) -> PilotCommand:
    """After a hand-over or a takeover: only a person's word, or the ground, ends this."""
    connection, inbox = flight.connection, flight.inbox
    wait_s = flight.mission.timeouts.handed_over_s
    flight.observer.phase("handed over", reason)
    flight.observer.message(
        "warning", "`companion resume` flies on, `companion land` lands; else the autopilot flies"
    )
    try:
        await connection.wait_until(
            lambda: inbox.waiting or not connection.reports.armed,
            wait_s,
            lambda: f"nobody resumed within {wait_s:g} s",
        )
    except LinkLostError:
        raise
    except FlightAbortedError as error:
        raise _HandedOverError(
            f"{reason}; {error}: the vehicle is left to the autopilot, in mode {connection.mode}"
        ) from error
    command = inbox.take()
    if command is None:
        raise _HandedOverError(f"{reason}; the autopilot has landed and disarmed the vehicle")
    if command is PilotCommand.ABORT:
        raise _HandedOverError(f"{reason}; aborted by command")
    return command


async def _land(flight: Flight) -> bool:
    """Land by the autopilot; the stream runs until the mode is confirmed."""
    connection = flight.connection
    flight.observer.phase("land", "by the autopilot")
    change = await connection.change_mode("land")
    flight.stream.stop()
    if change.verdict is not Verdict.ACCEPTED:
        flight.observer.message("error", f"{change.explanation}; left to the failsafe")
    return await _wait_disarmed(flight)


async def _wait_disarmed(flight: Flight) -> bool:
    connection = flight.connection
    try:
        await connection.wait_until(
            lambda: not connection.reports.armed or flight.inbox.waiting,
            flight.mission.timeouts.land_s,
            lambda: f"not disarmed within {flight.mission.timeouts.land_s:g} s",
        )
    except LinkLostError:
        raise
    except FlightAbortedError as error:
        flight.observer.message("error", f"{error}; mode {connection.mode}")
        return False
    return not connection.reports.armed


def _last_texts(connection: Connection) -> str:
    texts = [t for t in connection.reports.texts[-3:] if t]
    return f" It said: {' / '.join(texts)}" if texts else ""
