"""One flight over an open link, from its log's first byte to its outcome.

The same for real time and lockstep: whoever calls it brings the link and the loop.
"""

import asyncio
import contextlib
from dataclasses import dataclass
from typing import Literal

from companion.config.resolve import FlightConfig
from companion.flight.assemble import make_stack, supervisor_limits
from companion.flight.connection import Connection
from companion.flight.control_loop import ControlLoop
from companion.flight.errors import FlightAbortedError, FlightRefusedError, LinkLostError
from companion.flight.inbox import Inbox
from companion.flight.observer import Observer
from companion.flight.phases import Flight, fly
from companion.flight.setpoint_stream import SetpointStream
from companion.flight.timing import Percentiles, Punctuality, measure_timer_noise, percentiles_ms
from companion.link.link import Link
from companion.mavlink.dialects.px4 import Px4
from companion.mavlink.messages import VehicleStateOfHealth
from companion.recording.flight_log import FlightLog
from companion.trajectories.trajectory import Trajectory

OutcomeName = Literal["landed", "aborted", "refused"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a flight ended and how punctual it was."""

    outcome: OutcomeName
    completed: bool
    """The trajectory was flown to its end."""
    note: str
    scored_s: tuple[float, float] | None
    """Autopilot's times between which tracking is scored; None if it was never begun."""
    ticks: int
    missed_deadlines: int
    fallbacks: int
    latency: Percentiles | None
    """None in lockstep, where time does not pass while the companion computes."""
    timer_noise: Percentiles | None
    """How late the machine's timers were in the same run; None in lockstep."""
    r_max_active_share: float
    flight_s: float
    """By the autopilot's clock, from the first sample to the last."""


async def conduct(
    config: FlightConfig,
    trajectory: Trajectory,
    link: Link,
    log: FlightLog,
    inbox: Inbox,
    observer: Observer,
    *,
    real_time: bool,
    lost: "asyncio.Future[LinkLostError] | None" = None,
) -> Outcome:
    """Fly over a link.

    Args:
        config: mission, vehicle, controller.
        trajectory: what to track.
        link: open already; closed by the caller.
        log: open; closed by the caller.
        inbox: a person's commands.
        observer: told what happens.
        real_time: whether latencies mean anything.
        lost: done when it is known that the vehicle is gone (the embedded shim has died).
    """
    connection = Connection(link, Px4(), log)
    control = ControlLoop(
        make_stack(config.controller, config.vehicle, config.mission),
        supervisor_limits(config.mission),
    )
    punctuality = Punctuality(period_s=1.0 / config.mission.state_rate_hz)
    stream = SetpointStream(connection, control, log, observer, punctuality)
    flight = Flight(
        config.mission, config.controller.yaw, trajectory, connection, stream, inbox, observer
    )
    if lost is not None:
        lost.add_done_callback(lambda future: connection.fail(future.result()))
    noise: list[float] = []

    def tell(text: str) -> None:
        observer.message("error", text)
        log.record("event", loop.time(), {"severity": "error", "text": text})

    loop = asyncio.get_running_loop()
    helpers = [
        loop.create_task(connection.housekeeping(config.mission.timeouts.link_lost_s, tell)),
        loop.create_task(stream.watch()),
    ]
    if real_time:
        helpers.append(loop.create_task(measure_timer_noise(noise)))
    scored = None
    completed, name, note = False, "aborted", ""
    try:
        ending = await fly(flight)
        name = "landed" if ending.landed else "aborted"
        completed, note = ending.completed, ending.note
    except FlightRefusedError as error:
        name, note = "refused", str(error)
    except FlightAbortedError as error:
        note = str(error)
    finally:
        stream.stop()
        connection.health = VehicleStateOfHealth.STANDBY
        for task in helpers:
            task.cancel()
        for task in helpers:
            with contextlib.suppress(asyncio.CancelledError):
                await task
    if note:
        log.record("event", loop.time(), {"severity": "info", "text": note})
    if control.timeline is not None:
        scored = control.timeline.scored_s
    state = connection.state
    return Outcome(
        outcome=name,  # type: ignore[arg-type]
        completed=completed,
        note=note,
        scored_s=scored,
        ticks=punctuality.ticks,
        missed_deadlines=punctuality.missed_deadlines,
        fallbacks=stream.fallbacks,
        latency=percentiles_ms(punctuality.latencies_s) if real_time else None,
        timer_noise=percentiles_ms(noise) if real_time else None,
        r_max_active_share=stream.plans_at_r_max / max(1, stream.plans),
        flight_s=0.0 if state is None else state.time_s,
    )
