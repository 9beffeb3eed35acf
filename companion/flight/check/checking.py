"""A check of a vehicle without a flight: connect, listen, judge, and go.

It arms nothing and changes no mode.  The streams that it asks for are given back at its end.
"""

import asyncio
import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from companion.config.resolve import FlightConfig
from companion.flight.check.check_settings import fix_for_good, restore_list
from companion.flight.check.inspection import gather
from companion.flight.check.plan_to_check import plan_to_check
from companion.flight.check.restore_file import RestoreList
from companion.flight.errors import FlightAbortedError, LinkLostError
from companion.flight.vehicle.connection import Connection
from companion.link.link import Link
from companion.mavlink.commands import message_interval
from companion.mavlink.signing import Signing
from companion.preflight.facts import Facts
from companion.preflight.finding import Finding, Verdict, accepting
from companion.preflight.judgement import judge
from companion.trajectories.trajectory import Trajectory

_MEASURED_S = 3.0
_SILENCE_S = 1.0
Tell = Callable[[str, str], None]
"""Told severity and text."""


class _NoLog:
    """Records nothing."""

    def frame_in(self, time_s: float, raw: bytes) -> None:
        """A received frame."""

    def frame_out(self, time_s: float, raw: bytes) -> None:
        """A sent frame."""


@dataclass(frozen=True, slots=True)
class CheckOrder:
    """What to check, and what to do beside it."""

    config: FlightConfig
    trajectory: Trajectory
    fix_into: Path | None = None
    """Set the parameters that findings would have otherwise, for good, with this restore file."""
    restore: RestoreList | None = None
    """Set these back, and do nothing else."""


@dataclass(frozen=True, slots=True)
class Checked:
    """What came of it."""

    findings: tuple[Finding, ...]
    facts: Facts | None
    """None if nothing could be gathered."""
    restored: bool = False
    """All of the restore list is as it was."""


class _CannotGoOnError(Exception):
    """There is nothing more to check; the finding says why."""

    def __init__(self, finding: Finding) -> None:
        super().__init__(finding.found)
        self.finding = finding


async def check_vehicle(
    order: CheckOrder,
    link: Link,
    tell: Tell,
    *,
    signing: Signing | None = None,
    lost: "asyncio.Future[LinkLostError] | None" = None,
) -> Checked:
    """Check the vehicle at the other end of a link.

    Args:
        order: what to check.
        link: open already; closed by the caller.
        tell: told what is set and restored.
        signing: signs and checks the packets of the link; None for one without a key.
        lost: done when it is known that the vehicle is gone.
    """
    mission = order.config.mission
    connection = Connection(link, _NoLog(), signing, system_id=mission.link.system_id)
    connection.peers.wanted_component_id = mission.link.component_id
    if lost is not None:
        lost.add_done_callback(lambda future: connection.waiting.fail(future.result()))
    connection.lost_after_s = mission.timeouts.link_lost_s
    keeping = asyncio.get_running_loop().create_task(connection.housekeeping(lambda text: None))
    try:
        return await _check(order, connection, tell)
    except _CannotGoOnError as error:
        return Checked((error.finding,), None)
    except FlightAbortedError as error:
        remark = connection.admission.remark(vehicle_known=connection.peers.vehicle is not None)
        return Checked((Finding("link", str(error), Verdict.REFUSAL, remark),), None)
    finally:
        keeping.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await keeping


async def _check(order: CheckOrder, connection: Connection, tell: Tell) -> Checked:
    mission = order.config.mission
    await _connect(order, connection)
    if order.restore is not None:
        what_came, restored = await restore_list(order.restore, connection, tell)
        return Checked(what_came, None, restored)
    try:
        await connection.request_streams(mission.state_rate_hz)
        with contextlib.suppress(FlightAbortedError):
            await connection.waiting.until(
                lambda: connection.clock.valid and connection.state is not None,
                mission.timeouts.connect_s,
                lambda: "nothing came",
            )
        if connection.waiting.failure is not None:
            raise connection.waiting.failure
        facts = await gather(
            connection, _MEASURED_S, all_of_it=True, with_mocap=mission.mocap is not None
        )
        _refuse_silence(connection)
        plan = plan_to_check(order.config, order.trajectory, connection.our_system_id)
        done: list[Finding] = []
        if order.fix_into is not None:
            facts, done = await fix_for_good(facts, plan, connection, order.fix_into, tell)
        findings = [*judge(facts, plan), *done]
        return Checked(tuple(accepting(findings, mission.preflight.accept)), facts)
    finally:
        with contextlib.suppress(FlightAbortedError):
            for stream in connection.streams:
                await connection.exchanges.command(
                    message_interval(connection.target, int(stream.message_id), 0.0)
                )


async def _connect(order: CheckOrder, connection: Connection) -> None:
    mission = order.config.mission
    wait_s = mission.timeouts.connect_s
    try:
        await connection.waiting.until(
            lambda: connection.peers.vehicle is not None, wait_s, lambda: "nothing came"
        )
    except LinkLostError:
        raise
    except FlightAbortedError as error:
        remark = connection.admission.remark(vehicle_known=False)
        raise _CannotGoOnError(
            Finding(
                "autopilot",
                f"no HEARTBEAT of one came over {connection.link_description} within {wait_s:g} s",
                Verdict.REFUSAL,
                remark
                or "Check that the vehicle is on and sends to this address (PX4's onboard link "
                "sends to UDP port 14540), or give another --connect.",
            )
        ) from error
    vehicle = connection.peers.vehicle
    assert vehicle is not None
    if not connection.dialect_known:
        raise _CannotGoOnError(
            Finding(
                "autopilot",
                f"system {vehicle.system_id} has MAV_AUTOPILOT {vehicle.autopilot}, which the "
                "companion does not know",
                Verdict.REFUSAL,
                "It flies PX4 (12) and ArduPilot (3).",
            )
        )
    if mission.autopilot not in ("auto", connection.dialect.name):
        raise _CannotGoOnError(
            Finding(
                "autopilot",
                f"it is {connection.dialect.title}, and {mission.autopilot} was asked for",
                Verdict.REFUSAL,
                "Give the right --autopilot, or leave it out.",
            )
        )


def _refuse_silence(connection: Connection) -> None:
    """What was gathered while the link died says nothing of the vehicle.

    Raises:
        _CannotGoOnError: nothing comes any more.
    """
    silence_s = asyncio.get_running_loop().time() - connection.heard_s
    if silence_s > _SILENCE_S:
        raise _CannotGoOnError(
            Finding(
                "link",
                f"nothing was heard for {silence_s:.1f} s over {connection.link_description}: it "
                "died while the check ran",
                Verdict.REFUSAL,
                "Look after the link, then check again.",
            )
        )
