"""Everything before the companion flies: connect, become ready, arm.

Whatever is wrong here refuses the flight.
"""

from companion.flight.errors import DisarmedError, FlightAbortedError, FlightRefusedError
from companion.flight.inbox import PilotCommand
from companion.flight.stages.arming_watch import ArmingWatch
from companion.flight.stages.before_arming import used_by_others
from companion.flight.stages.crew import Flight, FlightScope
from companion.flight.stages.readiness import become_ready, last_texts
from companion.flight.stages.stream_rates import begin_measuring, measure_streams
from companion.flight.vehicle.reports import LANDED_IN_AIR, LANDED_TAKING_OFF
from companion.mavlink.commands import disarm
from companion.mavlink.dialects import dialect_named, dialect_names
from companion.mavlink.exchange import Verdict

_MOST_RESTARTS = 5
_MOST_LOOKS = 5
_TEXTS_FOLLOW_S = 0.5
"""ArduPilot denies arming first, and then says why."""
_FLYING = (LANDED_IN_AIR, LANDED_TAKING_OFF)


class _RestartedError(Exception):
    """The autopilot has restarted: what was asked of it has to be asked again."""


async def prepare(flight: Flight) -> None:
    """Connect and wait until the autopilot would arm.

    Nothing is armed yet, so an autopilot that restarts meanwhile is waited for.

    Raises:
        FlightRefusedError: something is wrong, or a person does not want to fly any more.
    """
    connection, timeouts = flight.connection, flight.mission.timeouts
    connection.lost_after_s = max(timeouts.link_lost_s, timeouts.connect_s)
    connection.waiting.interruption = lambda: _stopped_by_command(flight)
    try:
        await _connect(flight)
        for _ in range(_MOST_RESTARTS):
            try:
                await _prepare_once(flight)
            except _RestartedError:
                flight.voice.tell(
                    "warning", "the autopilot has restarted: asking it for everything again"
                )
            else:
                return
        raise FlightRefusedError(
            f"The autopilot restarted {_MOST_RESTARTS} times. Look at its power supply."
        )
    except FlightAbortedError as error:
        remark = connection.admission.remark(vehicle_known=connection.peers.vehicle is not None)
        raise FlightRefusedError(f"{error} {remark}".rstrip()) from error
    finally:
        flight.authority.rest()


async def _prepare_once(flight: Flight) -> None:
    """All that is true of one boot of the autopilot: streams, parameters, readiness.

    Raises:
        _RestartedError: it has restarted.
    """
    connection, mission = flight.connection, flight.mission
    restarts = connection.restarts

    mode: str | None = None

    def interruption() -> Exception | None:
        if connection.restarts > restarts:
            return _RestartedError()
        return used_by_others(flight, mode) or _blind(flight) or _stopped_by_command(flight)

    connection.waiting.interruption = interruption
    wait_s = mission.timeouts.connect_s
    await connection.waiting.until(
        lambda: connection.reports.custom_mode is not None,
        wait_s,
        lambda: f"The autopilot restarted, and then no HEARTBEAT came within {wait_s:g} s.",
    )
    _check_in_air(flight)
    await connection.request_streams(mission.state_rate_hz)
    at_once = connection.dialect.state_before_position
    await connection.waiting.until(
        lambda: connection.clock.valid and (connection.state is not None or not at_once),
        wait_s,
        lambda: (
            f"The autopilot answers, but within {wait_s:g} s there came "
            + _what_is_missing(flight)
            + ". Check the link's direction and that the estimator has a position."
        ),
    )
    begun = None
    if flight.inspector is not None:
        begun = begin_measuring(flight)
        await flight.inspector.before_flight()
    await flight.settings.learn()
    if flight.experiment is not None:
        await flight.experiment.prepare(flight.settings.takeoff_height_m)
    measured = connection.state is not None
    if measured:
        await measure_streams(flight, begun)
    if flight.mocap is not None:
        await flight.mocap.wait_for_poses(connection, wait_s)
    await become_ready(flight)
    mode = connection.mode  # from now on nothing but arming may change it
    if not measured:
        await measure_streams(flight)
    await flight.backend.become_ready(mission.timeouts.ready_s)
    if flight.scope is FlightScope.WHOLE:
        await _look_once_more(flight, wait_s)


def _blind(flight: Flight) -> Exception | None:
    """Why the flight is refused if heartbeats have stopped; None if they have not."""
    blind = flight.connection.blind_because
    if not blind:
        return None
    return FlightRefusedError(
        f"In preparation {blind}. Look for a program that has set the message's interval "
        "(SET_MESSAGE_INTERVAL of message 0), and restart the autopilot."
    )


async def _look_once_more(flight: Flight, wait_s: float) -> None:
    """Read the parameters again, and wait for a HEARTBEAT: only that tells armed.

    Arming follows it at once.

    Raises:
        FlightRefusedError: somebody else has armed it, or chosen another mode, or parameters with
            which the flight cannot be flown.
    """
    for _ in range(_MOST_LOOKS):
        await flight.settings.read_again()
        await _next_heartbeat(flight, wait_s)
        if not flight.settings.changed:
            return
    raise FlightRefusedError(
        "Somebody keeps setting parameters that the flight goes by: "
        f"{', '.join(flight.connection.dialect.flight_parameters)}. Wait until they are done."
    )


async def _next_heartbeat(flight: Flight, wait_s: float) -> None:
    reports = flight.connection.reports
    heard = reports.heartbeats
    await flight.connection.waiting.until(
        lambda: reports.heartbeats > heard,
        wait_s,
        lambda: f"No HEARTBEAT of the autopilot came within {wait_s:g} s.",
    )


async def arm_vehicle(flight: Flight) -> None:
    """Arm.

    Raises:
        FlightRefusedError: the vehicle did not arm.
        DisarmedError: it did, and somebody else has disarmed it, or it has restarted.
        LinkLostError: it is not known whether it did.
    """
    connection = flight.connection
    connection.lost_after_s = flight.mission.timeouts.link_lost_s
    if flight.mocap is not None:
        flight.mocap.check()
    flight.voice.phase("arm")
    mode = connection.mode
    others = used_by_others(flight)
    if others is not None:
        raise others
    watch = ArmingWatch(connection)
    connection.waiting.interruption = watch.look
    try:
        await _arm_under_watch(flight, watch, mode)
        connection.waiting.check()
    finally:
        flight.authority.rest()


async def _arm_under_watch(flight: Flight, watch: ArmingWatch, mode: str) -> None:
    connection = flight.connection
    exchange = await flight.backend.arm()
    if exchange.verdict is Verdict.REFUSED:
        await connection.waiting.pause(_TEXTS_FOLLOW_S)
        raise FlightRefusedError(
            f"Arming was denied: {exchange.explanation}. Look at the autopilot's messages in a "
            "ground station and mend what they name." + last_texts(flight)
        )
    if exchange.verdict is Verdict.ACCEPTED:
        watch.accepted()
    wait_s = flight.mission.timeouts.command_s
    try:
        await connection.waiting.until(
            lambda: connection.reports.armed,
            wait_s,
            lambda: f"for {wait_s:g} s its HEARTBEAT did not say armed",
        )
    except FlightAbortedError as error:
        if connection.waiting.failure is not None or isinstance(error, DisarmedError):
            raise
        flight.authority.rest()  # what disarms it now is ours
        # It may be armed all the same; standing on the ground it takes this.
        await connection.exchanges.command(disarm(connection.target))
        raise FlightRefusedError(
            f"The autopilot did not arm: {exchange.explanation}, and {error}. It was told to "
            "disarm again." + last_texts(flight)
        ) from error
    if connection.mode != mode or connection.reports.landed_state in _FLYING:
        # Armed is armed, whoever did it: an autopilot accepts arming also while it is.
        raise FlightAbortedError(
            f"While the companion armed, somebody else began to fly: mode {connection.mode}, "
            f"before it {mode}. The vehicle is left to them."
        )


def _stopped_by_command(flight: Flight) -> Exception | None:
    command = flight.inbox.take()
    if command is None:
        return None
    if command is PilotCommand.RESUME:
        flight.voice.tell("info", "nothing to resume: the flight has not begun")
        return None
    before = "arming" if flight.scope is FlightScope.WHOLE else "taking over"
    return FlightRefusedError(f"Stopped by command before {before}.")


async def _connect(flight: Flight) -> None:
    connection, mission = flight.connection, flight.mission
    flight.voice.phase("connect", connection.link_description)
    await connection.waiting.until(
        lambda: connection.peers.vehicle is not None,
        mission.timeouts.connect_s,
        lambda: (
            f"No HEARTBEAT of an autopilot came over {connection.link_description} within "
            f"{mission.timeouts.connect_s:g} s. Check that the vehicle is on and sends to this "
            "address (PX4's onboard link sends to UDP port 14540), or give --connect."
        ),
    )
    _check_kind(flight)


def _check_kind(flight: Flight) -> None:
    """The vehicle is of a kind that the companion flies, and of the one that is wanted."""
    connection, wanted = flight.connection, flight.mission.autopilot
    vehicle = connection.peers.vehicle
    assert vehicle is not None
    if not connection.dialect_known:
        raise FlightRefusedError(
            f"The autopilot on {connection.link_description} has MAV_AUTOPILOT "
            f"{vehicle.autopilot}, of which the companion knows nothing: it flies "
            f"{' and '.join(dialect_names())}."
        )
    found = connection.dialect
    if wanted not in ("auto", found.name):
        raise FlightRefusedError(
            f"The autopilot on {connection.link_description} has MAV_AUTOPILOT "
            f"{vehicle.autopilot}, which is {found.title}; {wanted} has "
            f"{dialect_named(wanted).autopilot_id}. Give --autopilot {found.name}, or auto."
        )


def _check_in_air(flight: Flight) -> None:
    """What is to be taken over in the air is there."""
    connection = flight.connection
    if flight.scope is FlightScope.AIRBORNE and not connection.reports.armed:
        raise FlightRefusedError(
            f"The vehicle is not armed (mode {connection.mode}): it does not hold in the air."
        )


def _what_is_missing(flight: Flight) -> str:
    connection = flight.connection
    names = connection.samples.source.names
    if connection.state is not None or not connection.dialect.state_before_position:
        return "no answer to TIMESYNC"
    if connection.samples.rejected_because:
        return f"no usable {names} ({connection.samples.rejected_because})"
    return f"no {names}"
