"""One flight over an open link, from its log's first byte to its outcome.

The same for real time and lockstep: whoever calls it brings the link and the loop.
"""

import asyncio
import contextlib
import traceback
from collections.abc import AsyncIterator, Coroutine, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

from companion.config.resolve import FlightConfig
from companion.config.yaml_source import ConfigError
from companion.control.qp.port import QpSolverFactory
from companion.flight.assemble import supervisor_limits
from companion.flight.assemble_plus import thrust_before_asking
from companion.flight.check.inspector import Inspector
from companion.flight.configuration_record import configuration_record
from companion.flight.errors import FlightAbortedError, FlightRefusedError, LinkLostError
from companion.flight.experiment import Experiment, ExperimentFlight
from companion.flight.inbox import Inbox
from companion.flight.log_keeper import log_keeper
from companion.flight.motion_capture import MotionCapture
from companion.flight.observer import Observer
from companion.flight.own_parts import OwnController, own_stacks
from companion.flight.records import CONFIGURATION
from companion.flight.setpoints import inputs
from companion.flight.setpoints.control_loop import ControlLoop
from companion.flight.setpoints.setpoint_stream import SetpointStream
from companion.flight.setpoints.stack_runner import Change
from companion.flight.setpoints.timing import (
    Percentiles,
    Punctuality,
    Times,
    measure_timer_noise,
    percentiles_ms,
)
from companion.flight.shared_link.sharing import shared_link, watch_link
from companion.flight.stacks import Stacks, make_stacks
from companion.flight.stages.authority import Authority
from companion.flight.stages.crew import Flight, FlightScope
from companion.flight.stages.mission_backend import make_backend
from companion.flight.stages.phases import fly
from companion.flight.stages.settings import Settings
from companion.flight.vehicle.connection import Connection
from companion.flight.voice import Voice
from companion.link.link import Link, LinkError
from companion.mavlink.signing import Signing
from companion.recording.flight_log import FlightLog
from companion.thrust_meaning import ThrustMeaning
from companion.trajectories.trajectory import Trajectory

OutcomeName = Literal["landed", "tracked", "aborted", "refused"]
"""`tracked`: begun and ended in the air, which only a simulated flight in lockstep may."""


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
    rejected_packets: Mapping[str, int] | None = None
    """Not read because of their signatures, by the reason; None without a key."""
    autopilot: str | None = None
    """Whose dialect was spoken: `px4`, `ardupilot`; None if none was heard."""
    changes: tuple[Change, ...] = ()
    """Hand-overs between controllers, planned or not, and what the monitor warned of."""
    monitor_worst: Mapping[str, float] | None = None
    """The largest of each of the monitor's gauges, 1 being the bound; None if it saw nothing."""


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
    make_solver: QpSolverFactory | None = None,
    scope: FlightScope = FlightScope.WHOLE,
    signing: Signing | None = None,
    mocap: MotionCapture | None = None,
    experiment: Experiment | None = None,
    own: OwnController | None = None,
    replayable: bool = True,
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
        make_solver: a QP solver in place of the configured one.
        scope: whether to take over a vehicle that is in the air already.  Only for a simulated
            one, which nobody else can be flying.
        signing: signs and checks the packets of the link; None for one without a key.
        mocap: poses for the autopilot; None if it needs none of ours.
        experiment: flown over the configured controller, which is its hold; None: that is flown.
        own: a controller of one's own, flown in the place of the configured one.  Only for a
            simulated vehicle.
        replayable: False if the trajectory is in no file.

    Raises:
        LinkError: an endpoint of `link.forward` cannot be opened.
        ValueError: a vehicle in the air was to be taken over in real time, or one that may be
            real to be flown by a controller of one's own.
    """
    if real_time and scope is not FlightScope.WHOLE:
        raise ValueError("only a simulated vehicle in lockstep is taken over in the air")
    if real_time and own is not None:
        raise ValueError("a controller of one's own flies only a simulated vehicle in lockstep")
    begun_s = asyncio.get_running_loop().time()
    replayable = replayable and make_solver is None and experiment is None and own is None
    log.record(CONFIGURATION.topic, begun_s, configuration_record(config, replayable=replayable))
    connection = Connection(link, log, signing, system_id=config.mission.link.system_id)
    voice = Voice(observer, log, connection.say)

    def stacks_for(thrust: ThrustMeaning) -> Stacks:
        if own is not None:
            return own_stacks(config, own, thrust)
        return make_stacks(config, make_solver, thrust=thrust)

    control = ControlLoop(
        stacks_for(thrust_before_asking(config.vehicle)), supervisor_limits(config.mission)
    )

    trial = None
    if experiment is not None:
        clock = asyncio.get_running_loop().time
        trial = ExperimentFlight(experiment, config, connection, control, log, clock)

    def adopt(thrust: ThrustMeaning) -> None:
        if trial is not None:
            with _refusing():
                trial.adopt(thrust)
            return
        with _refusing():
            stacks = stacks_for(thrust)
        control.adopt(stacks, supervisor_limits(config.mission))
        stream.note(inputs.ADOPT, inputs.adopt_values(thrust))

    punctuality = Punctuality(period_s=1.0 / config.mission.state_rate_hz)
    stream = SetpointStream(connection, control, log, voice, punctuality)
    flight = Flight(
        config.mission,
        config.controller.yaw,
        trajectory,
        connection,
        stream,
        inbox,
        Authority(connection, stream, inbox, voice),
        voice,
        Settings(config.mission, connection, stream, voice, adopt),
        make_backend(config.mission.link.mission_backend, connection),
        scope,
        None
        if scope is FlightScope.AIRBORNE
        else Inspector(config, trajectory, connection, voice, log.folder),
        mocap=mocap,
        experiment=trial,
    )
    connection.on_trouble = partial(voice.tell, "error")
    connection.chores.append(log_keeper(log, partial(voice.tell, "warning")))
    connection.admission.on_rejected = partial(voice.tell, "warning")
    connection.reports.on_text = voice.heard
    watch_link(flight)
    if lost is not None:
        lost.add_done_callback(lambda future: connection.waiting.fail(future.result()))
    noise = Times()
    helpers = [
        connection.housekeeping(partial(voice.tell, "error")),
        stream.watch(),
    ]
    if mocap is not None:
        flight.authority.fault = mocap.fault
        helpers.append(mocap.run(connection, voice.tell))
    if trial is not None:
        trial.watch(flight.authority)
    if real_time:
        helpers.append(measure_timer_noise(noise))
    completed, name, note = False, "aborted", ""
    try:
        async with _helped(helpers, connection, stream), shared_link(flight):
            ending = await fly(flight)
            name = "landed" if ending.landed else "tracked" if ending.tracked else "aborted"
            completed, note = ending.completed, ending.note
    except FlightRefusedError as error:
        name, note = "refused", str(error)
    except FlightAbortedError as error:
        note = str(error)
    except LinkError:
        raise  # an endpoint that cannot be opened: nothing has begun
    except Exception as error:
        # Armed or not, the stream has stopped; what is left is to say so and to keep the log.
        note = f"The companion failed ({type(error).__name__}: {error}) and stopped commanding."
        text = "".join(traceback.format_exception(error))
        log.record("event", asyncio.get_running_loop().time(), {"severity": "error", "text": text})
    if note:
        voice.tell("info" if name == "landed" else "error", note)
    scored = None
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
        latency=percentiles_ms(punctuality.latencies) if real_time else None,
        timer_noise=percentiles_ms(noise) if real_time else None,
        r_max_active_share=stream.plans_at_r_max / max(1, stream.plans),
        flight_s=0.0 if state is None else state.time_s,
        rejected_packets=(
            {reason.value: count for reason, count in sorted(connection.admission.rejected.items())}
            if connection.admission.checks
            else None
        ),
        autopilot=connection.dialect.name if connection.dialect_known else None,
        changes=tuple(stream.changes),
        monitor_worst=stream.monitor_worst,
    )


@contextlib.contextmanager
def _refusing() -> Iterator[None]:
    """Whether the files go together with this autopilot is known once it has been asked.

    Raises:
        FlightRefusedError: they don't.
    """
    try:
        yield
    except ConfigError as error:
        raise FlightRefusedError(str(error)) from error


@contextlib.asynccontextmanager
async def _helped(
    helpers: Sequence[Coroutine[Any, Any, None]], connection: Connection, stream: SetpointStream
) -> AsyncIterator[None]:
    """Run tasks beside the flight; stop the stream at its end, then them.

    A helper that dies ends the flight: without it the companion would be deaf or blind.
    """
    loop = asyncio.get_running_loop()

    def on_end(task: "asyncio.Task[None]") -> None:
        error = None if task.cancelled() else task.exception()
        if error is not None:
            text = f"The companion failed ({type(error).__name__}: {error}): handing over"
            connection.waiting.fail(
                FlightAbortedError(f"{text}; {connection.hand_over_explanation}.")
            )
            stream.hand_over(text)

    tasks = [loop.create_task(helper) for helper in helpers]
    for task in tasks:
        task.add_done_callback(on_end)
    try:
        yield
        stream.stop()
    except BaseException:
        # Whatever ended the flight, the vehicle is not left obeying a stream that is no more.
        stream.hand_over("the flight has ended")
        raise
    finally:
        await stream.handing_over.finished()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
