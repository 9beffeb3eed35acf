"""Gathering what the checks before a flight judge.  It asks and listens; it changes nothing."""

import asyncio
import math
from collections.abc import Iterable

from companion.flight.vehicle.connection import Connection
from companion.flight.vehicle.ears import Ears
from companion.flight.vehicle.parameters import Parameters
from companion.mavlink.dialect import Message
from companion.mavlink.message_request import request_message
from companion.mavlink.messages import COMPONENT_TRUTH, MessageId
from companion.preflight.facts import (
    BatteryFacts,
    EstimatorFacts,
    Facts,
    Identity,
    LinkFacts,
    StreamFacts,
)
from companion.preflight.judgement import parameters_to_read

_ESTIMATES = (MessageId.ESTIMATOR_STATUS, MessageId.EKF_STATUS_REPORT)
_ASKED_FOR = (
    MessageId.AUTOPILOT_VERSION,
    MessageId.HOME_POSITION,
    MessageId.SYS_STATUS,
    *_ESTIMATES,
)
_UNKNOWN_VOLTAGE = 65535
_RELEASES = {0: "dev", 64: "alpha", 128: "beta", 192: "rc"}
_LOCAL_HOSTS = ("127.", "localhost", "[::1]", "embedded")


async def gather(
    connection: Connection, measured_s: float, *, all_of_it: bool, with_mocap: bool = False
) -> Facts:
    """Ask for parameters and the version, and listen to the streams meanwhile.

    Streams must have been asked for, and the clock be valid.

    Args:
        connection: to a vehicle that is known.
        measured_s: how long the streams are measured at least, by the autopilot's clock.
        all_of_it: ask also for home and the estimator's state.
        with_mocap: read also what the estimator does with poses from outside.

    Raises:
        FlightAbortedError: the link was lost, or the wait was ended from outside.
    """
    loop = asyncio.get_running_loop()
    begun_s = loop.time()
    end_s = begun_s + connection.loop_seconds(measured_s)
    dialect = connection.dialect
    heard = (*(stream.message_id for stream in connection.streams), *_ASKED_FOR)
    ears = Ears(connection, dict.fromkeys(heard), begun_s)
    try:
        wanted = parameters_to_read(dialect.name, with_mocap=with_mocap)
        names = dict.fromkeys((*wanted, *dialect.flight_parameters))
        parameters = await _read(connection, names)
        await _ask(connection, MessageId.AUTOPILOT_VERSION)
        if all_of_it:
            for message_id in (MessageId.HOME_POSITION, *_ESTIMATES):
                await _ask(connection, message_id)
        await connection.waiting.pause(max(0.0, end_s - loop.time()))
        return Facts(
            identity=_identity(connection, ears.newest(MessageId.AUTOPILOT_VERSION)),
            streams=_streams(connection, ears, loop.time() - begun_s, loop.time()),
            link=_link(connection, loop.time()),
            parameters=parameters,
            thrust=dialect.thrust_meaning(parameters),
            battery=_battery(ears.newest(MessageId.SYS_STATUS)),
            estimator=_estimator(connection, ears, asked=all_of_it),
            stream_remedy=dialect.stream_remedy,
        )
    finally:
        ears.close()


async def _read(connection: Connection, names: Iterable[str]) -> dict[str, float]:
    reader = Parameters(connection)
    try:
        return await reader.read(names)
    finally:
        reader.close()


async def _ask(connection: Connection, message_id: MessageId) -> None:
    """Ask for one message; whether it came is seen by listening."""
    await connection.exchanges.command(request_message(connection.target, int(message_id)))


def _identity(connection: Connection, version: Message | None) -> Identity:
    target = connection.target
    others = connection.peers.other_vehicles
    known = {(target.system_id, target.component_id), *others}
    return Identity(
        autopilot=connection.dialect.name,
        version="" if version is None else version_text(int(version.flight_sw_version)),
        capabilities=None if version is None else int(version.capabilities),
        system_id=target.system_id,
        component_id=target.component_id,
        mode=connection.mode,
        armed=connection.reports.armed,
        landed_state=connection.reports.landed_state,
        other_vehicles=tuple(
            f"system {v.system_id}, component {v.component_id} (MAV_AUTOPILOT {v.autopilot})"
            for v in others.values()
        ),
        other_senders=tuple(
            f"system {p.system_id}, component {p.component_id}"
            for key, p in sorted(connection.peers.peers.items())
            if key not in known and p.component_id != COMPONENT_TRUTH
        ),
    )


def version_text(flight_sw_version: int) -> str:
    """AUTOPILOT_VERSION's version for a person: major, minor, patch, kind of release."""
    major, minor, patch, kind = flight_sw_version.to_bytes(4, "big")
    release = _RELEASES.get(kind & 0xC0 if kind != 0xFF else kind, "")
    return f"{major}.{minor}.{patch} {release}".rstrip()


def _streams(
    connection: Connection, ears: Ears, window_s: float, now_s: float
) -> tuple[StreamFacts, ...]:
    """What was granted, as it came, in the autopilot's time: a simulation may run fast."""
    pace = connection.clock.rate if connection.clock.valid else 1.0
    state = connection.samples.source.messages
    facts = []
    for stream in connection.streams:
        facts.append(
            StreamFacts(
                name=stream.message_id.name,
                asked_hz=1.0 / stream.interval_s,
                measured_hz=ears.rate_hz(stream.message_id, now_s) / pace,
                longest_gap_s=ears.longest_gap_s(stream.message_id, now_s) * pace,
                jitter_s=ears.jitter_s(stream.message_id) * pace,
                count=ears.count(stream.message_id),
                window_s=window_s * pace,
                is_state=stream.message_id in state,
                required=stream.required,
            )
        )
    return tuple(facts)


def _link(connection: Connection, now_s: float) -> LinkFacts:
    target = connection.target
    peer = connection.peers.peers[target.system_id, target.component_id]
    clock = connection.clock
    description = connection.link_description
    return LinkFacts(
        description=description,
        round_trips_s=clock.round_trips_s,
        clock_offset_s=clock.autopilot_time(now_s) - now_s if clock.valid else math.nan,
        clock_rate=clock.rate if clock.valid else 1.0,
        received=peer.received,
        lost=peer.lost,
        local=any(host in description for host in _LOCAL_HOSTS),
        we_sign=connection.admission.checks,
        vehicle_signs=bool(connection.admission.remark(vehicle_known=True)),
        rejected=sum(connection.admission.rejected.values()),
    )


def _battery(status: Message | None) -> BatteryFacts:
    if status is None:
        return BatteryFacts(math.nan, math.nan)
    remaining = status.battery_remaining / 100.0 if status.battery_remaining >= 0 else math.nan
    known = status.voltage_battery not in (0, _UNKNOWN_VOLTAGE)
    return BatteryFacts(remaining, status.voltage_battery / 1000.0 if known else math.nan)


def _estimator(connection: Connection, ears: Ears, *, asked: bool) -> EstimatorFacts:
    px4, ardupilot = (ears.newest(message_id) for message_id in _ESTIMATES)
    flags: int | None = None
    ratios: dict[str, float] = {}
    if px4 is not None:
        flags = int(px4.flags)
        ratios = {
            "velocity": px4.vel_ratio,
            "position": px4.pos_horiz_ratio,
            "height": px4.pos_vert_ratio,
            "compass": px4.mag_ratio,
        }
    elif ardupilot is not None:
        flags = int(ardupilot.flags)
        ratios = {
            "velocity": ardupilot.velocity_variance,
            "position": ardupilot.pos_horiz_variance,
            "height": ardupilot.pos_vert_variance,
            "compass": ardupilot.compass_variance,
        }
    dialect, readiness = connection.dialect, connection.readiness
    told = dialect.mode_before_arming is None or connection.mode == dialect.mode_before_arming
    return EstimatorFacts(
        flags=flags,
        ratios=ratios,
        home=ears.count(MessageId.HOME_POSITION) > 0 if asked else None,
        ready=readiness.ready if told else None,
        missing=readiness.missing,
    )
