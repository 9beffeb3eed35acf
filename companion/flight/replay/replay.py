"""Feeds a recorded flight's inputs through the control loop again, setpoint by setpoint.

The samples are read from the recorded packets, by the same code as in flight; times, delays, ages
and verdicts are those that were recorded.  Nothing here knows what time it is.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from companion.config.resolve import FlightConfig
from companion.flight.assemble import supervisor_limits
from companion.flight.assemble_plus import thrust_before_asking
from companion.flight.replay.recorded import (
    RecordedFlight,
    ReplayError,
    SentSetpoint,
    Ticked,
    Told,
)
from companion.flight.setpoints import inputs
from companion.flight.setpoints.control_loop import ControlLoop, Output
from companion.flight.setpoints.setpoint_stream import setpoint_of
from companion.flight.stacks import Stacks, make_stacks
from companion.mavlink.codec import decode
from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId, Target
from companion.mavlink.peers import PeerTable
from companion.mavlink.setpoints import (
    AttitudeSetpoint,
    InvalidSetpointError,
    Setpoint,
    setpoint_message,
)
from companion.mavlink.state_source import STATE_MESSAGES, StateReader, StateSource
from companion.mavlink.telemetry import Rejected, is_truth
from companion.thrust_meaning import ThrustMeaning
from companion.trajectories.trajectory import Trajectory
from companion.vehicle_state import VehicleState

_SAME_TIME_S = 2e-6
"""The log keeps times to a microsecond."""
_FARTHEST_FRAMES = 20_000
"""A sample that is not found within so many packets, half a minute, is missing."""


@dataclass(frozen=True, slots=True)
class ReplayedSetpoint:
    """A setpoint that left in flight, beside what leaves now."""

    time_s: float
    """Of the autopilot's clock."""
    phase: str
    recorded: bytes
    """Payload of SET_ATTITUDE_TARGET."""
    replayed: bytes | None
    """None: nothing leaves now."""

    @property
    def identical(self) -> bool:
        """Bit for bit."""
        return self.recorded == self.replayed


@dataclass(frozen=True, slots=True)
class Replay:
    """What a replay found."""

    setpoints: tuple[ReplayedSetpoint, ...]
    unmatched: int
    """Setpoints that could not be compared: of them the log holds a record or a packet, not both,
    or the sample that they were made of is missing."""

    @property
    def differing(self) -> tuple[ReplayedSetpoint, ...]:
        """Those that are not the same, bit for bit."""
        return tuple(s for s in self.setpoints if not s.identical)

    @property
    def identical(self) -> bool:
        """Every setpoint is the same, and there are some."""
        return bool(self.setpoints) and not self.differing and not self.unmatched


def replay(flight: RecordedFlight, trajectory: Trajectory, config: FlightConfig) -> Replay:
    """Feed a flight's inputs through the control loop.

    Args:
        flight: what was recorded.
        trajectory: the flight's, not placed.
        config: the flight's own, or one with another controller.

    Raises:
        ConfigError: the controller's gains are not ones that its laws are made for.
        ReplayError: the log lacks what the control loop was told.
    """
    replaying = _Replaying(flight, trajectory, config)
    setpoints: list[ReplayedSetpoint] = []
    try:
        for step in flight.steps:
            if isinstance(step, Told):
                setpoints += replaying.tell(step)
            else:
                setpoints += replaying.tick(step)
    except KeyError as error:
        raise ReplayError(
            f"the log lacks {error} of what the control loop was told: it is of another version. "
            "Replay it with the version that flew."
        ) from error
    return Replay(tuple(setpoints), flight.missing + replaying.unmatched)


class _Replaying:
    """A control loop that is led through a flight again."""

    def __init__(
        self, flight: RecordedFlight, trajectory: Trajectory, config: FlightConfig
    ) -> None:
        self.unmatched = 0
        self._config = config
        self._trajectory = trajectory
        self._control = ControlLoop(
            self._stacks(thrust_before_asking(config.vehicle)), supervisor_limits(config.mission)
        )
        self._samples = _Samples(flight)

    def _stacks(self, thrust: ThrustMeaning) -> Stacks:
        return make_stacks(self._config, thrust=thrust)

    def tell(self, told: Told) -> Iterator[ReplayedSetpoint]:
        """What it was told besides samples."""
        control, values = self._control, told.values
        if told.kind == inputs.ADOPT:
            stacks = self._stacks(inputs.thrust_meaning_from(values))
            control.adopt(stacks, supervisor_limits(self._config.mission))
        elif told.kind == inputs.START:
            control.release()
            control.idle = values["idle"]
            self._samples.source = StateSource[values["source"]]
        elif told.kind == inputs.ENGAGE:
            timeline = inputs.timeline_from(values, self._trajectory)
            control.engage(timeline, values["yaw_rad"], tuple(values["anchor_enu_m"]))
        elif told.kind == inputs.HOLD:
            yield from self._hold(told)

    def _hold(self, told: Told) -> Iterator[ReplayedSetpoint]:
        level = self._control.level()
        for sent in told.sent:
            # When each of them leaves is the event loop's doing, so its time is taken over.
            time_s = int.from_bytes(sent.payload[:4], "little") * 1e-3
            made = None if level is None else _payload(AttitudeSetpoint(*level), time_s, sent)
            yield ReplayedSetpoint(time_s, "hand over", sent.payload, made)

    def tick(self, tick: Ticked) -> Iterator[ReplayedSetpoint]:
        """A sample, or a step in silence."""
        if tick.in_silence:
            output = self._control.on_silence(tick.time_s, tick.state_age_s, tick.unusable)
            time_s = tick.time_s
        else:
            state = self._samples.of(tick.time_s)
            if state is None:
                self.unmatched += tick.sent is not None
                return
            output = self._control.on_sample(state, tick.loop_delay_s)
            time_s = state.time_s
        if tick.sent is not None:
            made = _made(output, time_s, tick.sent)
            yield ReplayedSetpoint(time_s, tick.phase, tick.sent.payload, made)


class _Samples:
    """The vehicle's states, read from the packets in their order."""

    def __init__(self, flight: RecordedFlight) -> None:
        self.source = StateSource.ODOMETRY
        self._reader = StateReader()
        link = flight.config.mission.link
        self._peers = PeerTable(link.system_id, link.component_id)
        self._frames = flight.received
        self._place = 0

    def of(self, time_s: float) -> VehicleState | None:
        """The next sample of a time of the autopilot's clock.

        None if there is none: then those that come are still to be read.
        """
        place = self._place
        while place < min(len(self._frames), self._place + _FARTHEST_FRAMES):
            frame = self._frames[place]
            place += 1
            state = self._state(frame, time_s)
            if state is not None and abs(state.time_s - time_s) < _SAME_TIME_S:
                self._place = place
                return state
        return None

    def _state(self, frame: Frame, about_s: float) -> VehicleState | None:
        if frame.message_id == MessageId.HEARTBEAT:
            self._peers.on_heartbeat(frame, decode(frame))
        if frame.message_id not in STATE_MESSAGES or is_truth(frame):
            return None
        if not self._peers.is_vehicle(frame):
            return None
        self._reader.source = self.source
        sample = self._reader.take(frame, about_s)
        return None if isinstance(sample, Rejected) else sample


def _made(output: Output | None, time_s: float, sent: SentSetpoint) -> bytes | None:
    if output is None or output.attitude_flu_to_enu is None:
        return None
    try:
        setpoint = setpoint_of(output, output.attitude_flu_to_enu)
    except InvalidSetpointError:
        return None
    return _payload(setpoint, time_s, sent)


def _payload(setpoint: Setpoint, time_s: float, sent: SentSetpoint) -> bytes | None:
    try:
        return setpoint_message(setpoint, time_s, Target(*sent.target)).payload
    except InvalidSetpointError:
        return None
