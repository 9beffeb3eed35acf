"""A flight on the wall clock: to a real autopilot over any link, or to the embedded shim."""

import asyncio
import contextlib
import gc
import time
from dataclasses import replace
from functools import partial

from companion.config.mocap_models import MocapConfig
from companion.config.resolve import FlightConfig
from companion.flight.command_socket import CommandServer
from companion.flight.conduct import Outcome, conduct
from companion.flight.experiment import Experiment
from companion.flight.inbox import Inbox
from companion.flight.motion_capture import motion_capture
from companion.flight.observer import Observer
from companion.flight.shim_process import (
    ShimOptions,
    ShimProcess,
    start_shim,
    with_state_rate,
)
from companion.flight.signals import commands_by_signal
from companion.link.make import make_link
from companion.link.udp import UdpLink
from companion.link.url import parse_link_url
from companion.mavlink.peers import vehicle_heartbeat_in
from companion.mavlink.signing import Signing
from companion.recording.flight_log import FlightLog
from companion.trajectories.trajectory import Trajectory

_EMBEDDED_URL = "udpin://127.0.0.1:0"


def fly_in_real_time(
    config: FlightConfig,
    trajectory: Trajectory,
    log: FlightLog,
    observer: Observer,
    shim: ShimOptions | None,
    *,
    signing_key: bytes | None = None,
    experiment: Experiment | None = None,
) -> Outcome:
    """Fly; Ctrl-C lands, a second Ctrl-C hands over at once.

    Args:
        config: mission, vehicle, controller.
        trajectory: what to track.
        log: open; closed by the caller.
        observer: told what happens.
        shim: start this shim and fly it; None to fly what `mission.connect` names.
        signing_key: 32 bytes, to sign packets with and to check them by; None: neither is done.
        experiment: flown in the place of the controller; None: the controller flies.

    Raises:
        LinkError: the link can't be opened.
        MocapError: the motion capture's poses can't be listened for.
        ShimRefusedError: the embedded shim can't simulate what it was asked for.
    """
    runner = asyncio.Runner()
    try:
        return runner.run(_fly(config, trajectory, log, observer, shim, signing_key, experiment))
    finally:
        # It starts a thread to end others, which takes memory that there may not be; the flight is
        # over and has a result all the same.
        with contextlib.suppress(RuntimeError, MemoryError):
            runner.close()


def _signing(config: FlightConfig, key: bytes | None) -> Signing | None:
    """Signs by the calendar's time at the start, carried on by the loop's, which only grows."""
    if key is None:
        return None
    loop = asyncio.get_running_loop()
    epoch_unix_s = time.time() - loop.time()
    link = config.mission.link.signing
    link_id = 0 if link is None else link.link_id
    return Signing(key, lambda: epoch_unix_s + loop.time(), link_id)


def _listening(config: FlightConfig, options: ShimOptions | None) -> MocapConfig | None:
    """Where poses are listened for: the embedded shim's cameras take any free port."""
    mocap = config.mission.mocap
    if mocap is None or options is None:
        return mocap
    return mocap.model_copy(update={"host": "127.0.0.1", "port": 0})


def log_base_us() -> int:
    """Microseconds since 1970 at the event loop's time 0, for time stamps in logs."""
    return round((time.time() - time.monotonic()) * 1e6)


async def _fly(
    config: FlightConfig,
    trajectory: Trajectory,
    log: FlightLog,
    observer: Observer,
    options: ShimOptions | None,
    signing_key: bytes | None,
    experiment: Experiment | None,
) -> Outcome:
    inbox = Inbox()
    signing = _signing(config, signing_key)
    link = make_link(
        parse_link_url(config.mission.connect or _EMBEDDED_URL),
        accept_peer=partial(
            vehicle_heartbeat_in, verifier=None if signing is None else signing.verifier
        ),
    )
    server = CommandServer(inbox)
    shim: ShimProcess | None = None
    room = contextlib.AsyncExitStack()
    await link.open()
    # A collection of everything that was imported takes milliseconds; none of it is garbage.
    gc.collect()
    gc.freeze()
    try:
        mocap = await room.enter_async_context(motion_capture(_listening(config, options)))
        try:
            await server.open()
        except OSError as error:
            observer.message("warning", f"no command socket, only Ctrl-C: {error}")
        if options is not None:
            assert isinstance(link, UdpLink)
            assert link.local is not None
            options = with_state_rate(options, config.mission.state_rate_hz)
            if mocap is not None:
                options = replace(options, mocap_port=mocap.port)
            shim = await start_shim(options, link.local[1])
        with commands_by_signal(inbox, observer):
            return await conduct(
                config,
                trajectory,
                link,
                log,
                inbox,
                observer,
                real_time=True,
                lost=shim.lost if shim else None,
                signing=signing,
                mocap=mocap,
                experiment=experiment,
            )
    finally:
        link.close()
        await room.aclose()
        with contextlib.suppress(OSError):
            await server.close()
        if shim is not None:
            await shim.end()
