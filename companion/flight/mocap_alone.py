"""The bridge of motion capture without a flight: poses to an autopilot, until a person ends it."""

import asyncio
import time
from collections.abc import Callable
from functools import partial

from companion.config.models import MissionConfig
from companion.flight.errors import LinkLostError
from companion.flight.motion_capture import MotionCapture, motion_capture
from companion.flight.vehicle.connection import Connection
from companion.link.make import make_link
from companion.link.url import LinkUrl
from companion.mavlink.peers import vehicle_heartbeat_in
from companion.mavlink.signing import Signing

Tell = Callable[[str, str], None]
"""Told severity and text."""

_REPORTED_EVERY_S = 5.0


class _NoLog:
    """Records nothing."""

    def frame_in(self, time_s: float, raw: bytes) -> None:
        """A received frame."""

    def frame_out(self, time_s: float, raw: bytes) -> None:
        """A sent frame."""


def bridge_alone(
    mission: MissionConfig, url: LinkUrl, tell: Tell, *, signing_key: bytes | None = None
) -> None:
    """Send poses to the autopilot at the other end of a link until interrupted.

    Args:
        mission: of which `mocap`, `link` and `timeouts` matter.
        url: leads to the autopilot.
        tell: told what happens.
        signing_key: 32 bytes, to sign packets with and to check them by; None: neither is done.

    Raises:
        LinkError: the link can't be opened.
        MocapError: poses can't be listened for.
        LinkLostError: nothing is heard from the autopilot any more.
        KeyboardInterrupt: a person ended it.
    """
    with asyncio.Runner() as runner:
        runner.run(_bridge(mission, url, tell, signing_key))


async def _bridge(mission: MissionConfig, url: LinkUrl, tell: Tell, key: bytes | None) -> None:
    loop = asyncio.get_running_loop()
    signing = None
    if key is not None:
        epoch_unix_s = time.time() - loop.time()
        link_id = 0 if mission.link.signing is None else mission.link.signing.link_id
        signing = Signing(key, lambda: epoch_unix_s + loop.time(), link_id)
    verifier = None if signing is None else signing.verifier
    link = make_link(url, partial(vehicle_heartbeat_in, verifier=verifier))
    async with motion_capture(mission.mocap) as mocap:
        assert mocap is not None
        await link.open()
        try:
            connection = Connection(link, _NoLog(), signing, system_id=mission.link.system_id)
            connection.lost_after_s = mission.timeouts.link_lost_s
            tell("info", f"poses from {mocap.source}, to the autopilot on {link.description}")
            async with asyncio.TaskGroup() as group:
                group.create_task(connection.housekeeping(partial(tell, "error")))
                group.create_task(mocap.run(connection, tell))
                group.create_task(_report(mocap, connection, tell))
        except* LinkLostError as lost:
            raise lost.exceptions[0] from None
        finally:
            link.close()


async def _report(mocap: MotionCapture, connection: Connection, tell: Tell) -> None:
    """Say every few seconds how it goes, until the link is lost."""
    loop = asyncio.get_running_loop()
    sent_before, before_s = 0, loop.time()
    while True:
        await asyncio.sleep(_REPORTED_EVERY_S)
        if connection.waiting.failure is not None:
            raise connection.waiting.failure
        now_s, sent = loop.time(), mocap.bridge.sent
        rate = (sent - sent_before) / (now_s - before_s)
        sent_before, before_s = sent, now_s
        if connection.peers.vehicle is None:
            tell("warning", f"no autopilot on {connection.link_description} yet")
        tell("info", f"{rate:.0f} poses a second on their way ({mocap.bridge.describe()})")
