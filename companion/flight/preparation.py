"""Everything before the companion flies: connect, become ready, arm.

Whatever is wrong here refuses the flight.
"""

from companion.flight.crew import Flight, FlightScope
from companion.flight.errors import FlightAbortedError, FlightRefusedError
from companion.flight.inbox import PilotCommand
from companion.mavlink.commands import arm, disarm
from companion.mavlink.exchange import Verdict

_RATE_MEASURED_S = {FlightScope.WHOLE: 1.0, FlightScope.AIRBORNE: 0.5}
_SLOWEST_STATE_HZ = 30.0
_RATE_WARNING = 0.7


async def prepare(flight: Flight) -> None:
    """Connect and wait until the autopilot would arm.

    Raises:
        FlightRefusedError: something is wrong, or a person does not want to fly any more.
    """
    flight.connection.waiting.interruption = lambda: _stopped_by_command(flight)
    try:
        await _connect(flight)
        await _become_ready(flight)
    except FlightAbortedError as error:
        connection = flight.connection
        remark = connection.admission.remark(vehicle_known=connection.peers.vehicle is not None)
        raise FlightRefusedError(f"{error} {remark}".rstrip()) from error
    finally:
        flight.authority.rest()


async def arm_vehicle(flight: Flight) -> None:
    """Arm.

    Raises:
        FlightRefusedError: the vehicle did not arm.
        LinkLostError: it is not known whether it did.
    """
    connection = flight.connection
    flight.voice.phase("arm")
    exchange = await connection.exchanges.command(arm(connection.target))
    if exchange.verdict is Verdict.REFUSED:
        raise FlightRefusedError(
            f"Arming was denied: {exchange.explanation}. Look at the autopilot's messages in a "
            "ground station and mend what they name." + last_texts(flight)
        )
    wait_s = flight.mission.timeouts.command_s
    try:
        await connection.waiting.until(
            lambda: connection.reports.armed,
            wait_s,
            lambda: f"for {wait_s:g} s its HEARTBEAT did not say armed",
        )
    except FlightAbortedError as error:
        if connection.waiting.failure is not None:
            raise
        # It may be armed all the same; standing on the ground it takes this.
        await connection.exchanges.command(disarm(connection.target))
        raise FlightRefusedError(
            f"The autopilot did not arm: {exchange.explanation}, and {error}. It was told to "
            "disarm again." + last_texts(flight)
        ) from error


def last_texts(flight: Flight) -> str:
    """The autopilot's last words, as a sentence; empty if it said nothing."""
    texts = [text for text in flight.connection.reports.texts[-3:] if text]
    return f" It said: {' / '.join(texts)}" if texts else ""


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
    vehicle = connection.peers.vehicle
    assert vehicle is not None
    if vehicle.autopilot != connection.dialect.autopilot_id:
        raise FlightRefusedError(
            f"The autopilot on {connection.link_description} has MAV_AUTOPILOT "
            f"{vehicle.autopilot}; {connection.dialect.name} has "
            f"{connection.dialect.autopilot_id}. Give the right --autopilot."
        )
    _check_armed(flight)
    await connection.exchanges.request_streams(connection.target, mission.state_rate_hz)
    await connection.waiting.until(
        lambda: connection.clock.valid and connection.state is not None,
        mission.timeouts.connect_s,
        lambda: (
            f"The autopilot answers, but within {mission.timeouts.connect_s:g} s there came "
            + _what_is_missing(flight)
            + ". Check the link's direction and that the estimator has a position."
        ),
    )
    await _measure_rate(flight)


def _check_armed(flight: Flight) -> None:
    """Before a flight it is as the scope says: the companion takes over none that it may not."""
    connection = flight.connection
    if flight.scope is FlightScope.AIRBORNE:
        if not connection.reports.armed:
            raise FlightRefusedError(
                f"The vehicle is not armed (mode {connection.mode}): it does not hold in the air."
            )
    elif connection.reports.armed:
        raise FlightRefusedError(
            f"The vehicle is armed already (mode {connection.mode}). The companion takes over no "
            "flight that it did not start: land and disarm, then start again."
        )


def _what_is_missing(flight: Flight) -> str:
    connection = flight.connection
    if connection.state is not None:
        return "no answer to TIMESYNC"
    if connection.rejected_because:
        return f"no usable ODOMETRY ({connection.rejected_because})"
    return "no ODOMETRY"


async def _measure_rate(flight: Flight) -> None:
    """Streams are asked for, then measured: what an autopilot grants is not what it sends."""
    connection = flight.connection
    first = connection.state
    assert first is not None
    count_before = connection.samples
    await connection.waiting.pause(_RATE_MEASURED_S[flight.scope])
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
        flight.voice.tell(
            "warning", f"the state arrives at {rate:.0f} Hz, {wanted:g} Hz were asked for"
        )
    flight.stream.punctuality.period_s = connection.loop_seconds(1.0 / rate)


async def _become_ready(flight: Flight) -> None:
    connection = flight.connection
    flight.voice.phase("ready", f"{connection.dialect.name}, mode {connection.mode}")
    await connection.waiting.until(
        lambda: connection.readiness.ready,
        flight.mission.timeouts.ready_s,
        lambda: (
            f"The autopilot did not become ready within {flight.mission.timeouts.ready_s:g} s. "
            f"It waits for: {', '.join(connection.readiness.missing)}." + last_texts(flight)
        ),
    )
