"""An experiment in the place of a controller: its stack, its box, and what it wants recorded."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from companion.config.resolve import FlightConfig
from companion.control.thrust import GRAVITY_M_S2
from companion.flight.assemble import make_paper_stack, supervisor_limits
from companion.flight.errors import FlightAbortedError, FlightRefusedError
from companion.flight.setpoints.control_loop import ControlLoop
from companion.flight.stages.authority import Authority
from companion.flight.vehicle.connection import Connection
from companion.flight.voice import RecordLog
from companion.identification.excitation import Box, Program
from companion.identification.excitation_stack import ExcitationStack
from companion.mavlink.codec import decode
from companion.mavlink.commands import message_interval
from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId
from companion.recording.schema import ChannelSpec, Field
from companion.thrust_meaning import COLLECTIVE, ThrustMeaning

EXPERIMENT = ChannelSpec(
    "experiment",
    (
        Field("autopilot", "string", "px4 or ardupilot"),
        Field("thrust_kind", "string", "what the thrust field means"),
        Field("thrust_climb_m_s", description="of a climb-rate field: what 1 asks for"),
        Field("thrust_descent_m_s", description="of a climb-rate field: what 0 asks for"),
        Field("box_horizontal_m", description="half the width of the box"),
        Field("box_vertical_m", description="half the height of the box"),
        Field("hover_guess", description="thrust field at hover that the hold began with"),
        Field("vehicle", "object", "what was known of the vehicle, as its file has it"),
    ),
    "what an identification was flown with; one record for each engagement",
)

THRUST_REPORT = ChannelSpec(
    "thrust_report",
    (
        Field("autopilot_time_s", description="the autopilot's clock"),
        Field("thrust", description="that it commands its motors, 0..1 (ATTITUDE_TARGET)"),
    ),
    "what the autopilot says of its thrust",
)

EXPERIMENT_CHANNELS = (EXPERIMENT, THRUST_REPORT)

_REPORT_INTERVAL_S = 0.05
_REMEMBERED = 20
_FEWEST = 5
_LEAST_WEIGHT = 0.5
_BELIEVED = (0.1, 0.9)
"""A reported thrust of hover outside this is none."""


@dataclass(frozen=True, slots=True)
class Experiment:
    """What is played, and where it may lead."""

    program: Program
    box: Box


@dataclass(slots=True)
class ExperimentFlight:
    """An experiment on a flight: makes the stacks, watches the box, hears the thrust."""

    experiment: Experiment
    config: FlightConfig
    connection: Connection
    control: ControlLoop
    log: RecordLog
    now: Callable[[], float]
    """The loop's clock."""
    meaning: ThrustMeaning = COLLECTIVE
    reported: list[tuple[float, float, float]] = field(default_factory=list)
    """The newest thrusts that the autopilot has reported, oldest first: time, thrust, and the
    climb rate at that time, s, 0..1, m/s."""

    def __post_init__(self) -> None:
        """Listen from now on."""
        heard = self.connection.listeners.setdefault(int(MessageId.ATTITUDE_TARGET), [])
        heard.append(self._on_attitude_target)

    def adopt(self, thrust: ThrustMeaning) -> None:
        """Fly with the stack for a meaning of the thrust field; only while holding."""
        self.meaning = thrust
        config = self.config
        vehicle = config.vehicle.model_copy(update={"hover_thrust": self.hover_guess})
        hold = make_paper_stack(config.controller, vehicle, config.mission, thrust=thrust)
        stack = ExcitationStack(hold, self.experiment.program, self.experiment.box)
        self.control.adopt(stack, supervisor_limits(config.mission))

    def watch(self, authority: Authority) -> None:
        """End the flight by a landing when the vehicle is outside the box."""
        others = authority.fault
        authority.fault = lambda: self._strayed() or others()

    def _strayed(self) -> FlightAbortedError | None:
        state = self.connection.state
        if state is None:
            return None
        wanted = self.control.desired_position(state.time_s)
        if wanted is None:
            return None
        x, y, z = (p - float(w) for p, w in zip(state.position_enu_m, wanted, strict=True))
        box = self.experiment.box
        if box.outside_m((x, y, z)) <= 0.0:
            return None
        return FlightAbortedError(
            f"The vehicle left the box of ±{box.horizontal_m:g} m (±{box.vertical_m:g} m in "
            "height) about its hover point: too much wind for it, or an estimate that wanders. "
            "Give it a larger --box, or calmer air."
        )

    @property
    def hover_guess(self) -> float:
        """The thrust that the autopilot itself hovers with, else the vehicle's file's.

        Its mean, less what changed the climb rate meanwhile: a take-off has just ended.
        """
        vehicle = self.config.vehicle
        if len(self.reported) < _FEWEST:
            return vehicle.hover_thrust
        (first_s, _, sinking), (last_s, _, rising) = self.reported[0], self.reported[-1]
        acceleration = (rising - sinking) / max(_REPORT_INTERVAL_S, last_s - first_s)
        mean = sum(thrust for _, thrust, _ in self.reported) / len(self.reported)
        hover = mean / max(_LEAST_WEIGHT, 1.0 + acceleration / GRAVITY_M_S2)
        if not _BELIEVED[0] < hover < _BELIEVED[1]:
            return vehicle.hover_thrust
        return max(vehicle.minimum_thrust + 0.01, min(vehicle.maximum_thrust - 0.01, hover))

    async def prepare(self, takeoff_height_m: float) -> None:
        """See whether the take-off leads into the fence, and ask for the thrust reports.

        Reports that do not come cost figures, not the flight.

        Args:
            takeoff_height_m: to which the autopilot will take off.

        Raises:
            FlightRefusedError: it leads out of the top.
            FlightAbortedError: the wait was ended from outside.
        """
        top_m = self.config.mission.geofence.high_m[2]
        if takeoff_height_m > top_m:
            raise FlightRefusedError(
                f"The autopilot takes off to {takeoff_height_m:g} m (PX4: MIS_TAKEOFF_ALT), above "
                f"the {top_m:g} m that this flight may reach. Identify at that height (--height "
                f"{takeoff_height_m:g}; a stated geofence must reach above it), or let it take "
                "off lower."
            )
        interval = message_interval(
            self.connection.target, int(MessageId.ATTITUDE_TARGET), _REPORT_INTERVAL_S
        )
        await self.connection.exchanges.command(interval)

    def before_engaging(self) -> None:
        """Take what the autopilot's hover has told, and keep what is flown; only while holding."""
        self.adopt(self.meaning)
        box = self.experiment.box
        self.log.record(
            EXPERIMENT.topic,
            self.now(),
            {
                "autopilot": self.connection.dialect.name,
                "thrust_kind": self.meaning.kind,
                "thrust_climb_m_s": self.meaning.climb_m_s,
                "thrust_descent_m_s": self.meaning.descent_m_s,
                "box_horizontal_m": box.horizontal_m,
                "box_vertical_m": box.vertical_m,
                "hover_guess": self.hover_guess,
                "vehicle": self.config.vehicle.model_dump(mode="json"),
            },
        )

    def _on_attitude_target(self, frame: Frame, received_s: float) -> None:
        """The autopilot says what it commands.

        https://mavlink.io/en/messages/common.html#ATTITUDE_TARGET
        """
        message = decode(frame)
        thrust = float(message.thrust)
        state, time_s = self.connection.state, message.time_boot_ms * 1e-3
        if not math.isfinite(thrust) or state is None:
            return
        newest = (time_s, thrust, state.velocity_enu_m_s[2])
        self.reported = [*self.reported[1 - _REMEMBERED :], newest]
        values = {"autopilot_time_s": time_s, "thrust": thrust}
        self.log.record(THRUST_REPORT.topic, received_s, values)
