"""What an autopilot is to the rest of the shim, whatever its flavour."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple, Protocol

from sitl_shim.autopilot.mission_plan import MissionPlan
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Quaternion, Vector3

RotorCommands = tuple[float, float, float, float]
"""Signals of the four rotors, 0 to 1, in PX4's order for a quad X."""

TICK_S = 0.004
"""Period of the control loop, of the plant and of the autopilot's clock."""
TICK_US = 4_000
TICK_RATE_HZ = 250.0


class Motion(Protocol):
    """What an autopilot knows of its motion: the estimator's output.  World ENU, body FLU."""

    @property
    def time_s(self) -> float:
        """Of the estimate, since boot."""

    @property
    def position_enu_m(self) -> Vector3:
        """In the local frame."""

    @property
    def velocity_enu_m_s(self) -> Vector3:
        """Over ground."""

    @property
    def attitude_flu_to_enu(self) -> Quaternion:
        """(w, x, y, z), unit norm."""

    @property
    def rate_flu_rad_s(self) -> Vector3:
        """Body rates."""

    @property
    def acceleration_enu_m_s2(self) -> Vector3:
        """Kinematic: 0 at rest."""

    @property
    def local_position_valid(self) -> bool:
        """Whether the position in the local frame may be believed."""

    @property
    def global_position_valid(self) -> bool:
        """Whether it is known where on Earth the vehicle is."""


@dataclass(frozen=True, slots=True)
class Command:
    """A command of MAVLink's command protocol (COMMAND_LONG, or COMMAND_INT brought to it)."""

    command: int
    """MAV_CMD."""
    parameters: tuple[float, float, float, float, float, float, float]
    """param1 to param7; NaN where the sender leaves the choice to the autopilot."""
    position_xy_m: tuple[float, float] | None = None
    """param5 and param6 read as latitude and longitude, in the local frame (east, north)."""
    altitude_m: float = math.nan
    """param7 read as an altitude: in the local frame, or above home."""
    above_home: bool = False
    """Which of the two."""


@dataclass(frozen=True, slots=True)
class Acknowledgement:
    """One COMMAND_ACK that a command brings about."""

    result: int
    """MAV_RESULT."""
    delay_us: int
    """From the command's arrival to the acknowledgement."""


@dataclass(frozen=True, slots=True)
class StatusText:
    """One text for the person at the ground station."""

    severity: int
    """MAV_SEVERITY."""
    text: str


class AttitudeTarget(NamedTuple):
    """An attitude or rate setpoint that came in.  World ENU, body FLU.

    The fields hold what was sent, also where ``type_mask`` says to ignore it; NaN passes.
    """

    type_mask: int
    """ATTITUDE_TARGET_TYPEMASK of MAVLink."""
    attitude_flu_to_enu: Quaternion
    """As sent: of any norm."""
    rate_flu_rad_s: Vector3
    thrust: float
    """Collective, 0 to 1."""


class Announcement(Enum):
    """Messages that an autopilot sends on all links without being asked, when something changed."""

    HEARTBEAT = "heartbeat"
    ORIGIN = "origin"
    HOME = "home"


@dataclass(frozen=True, slots=True)
class EstimatorState:
    """How far the estimator has got."""

    flags: int
    """EKF_STATUS_FLAGS of ArduPilot's EKF_STATUS_REPORT."""
    gps_fix: int
    """GPS_FIX_TYPE."""
    origin_known: bool
    """Whether the local frame's origin is set."""
    position_known: bool
    """Whether positions and velocities are estimated."""
    yaw_error_rad: float
    """Its heading is off by this, about up, until it aligns itself in flight."""


@dataclass(frozen=True, slots=True)
class EstimateStep:
    """By how much the estimator set its estimate anew."""

    position_enu_m: Vector3
    velocity_enu_m_s: Vector3
    yaw_rad: float
    """About up."""


@dataclass(frozen=True, slots=True)
class BatteryReport:
    """What the battery's monitor says."""

    remaining: float
    """Share of the charge, 0 to 1."""
    voltage_v: float


FULL = BatteryReport(1.0, math.inf)
"""Of a battery of which nothing is known yet."""


@dataclass(frozen=True, slots=True)
class PositionSetpoint:
    """A position, velocity and acceleration setpoint that came in.  World ENU.

    NaN stands for what the sender leaves out.
    """

    position_enu_m: Vector3
    velocity_enu_m_s: Vector3
    acceleration_enu_m_s2: Vector3
    yaw_enu_rad: float
    yaw_rate_rad_s: float
    """About the vertical, positive to the left."""


@dataclass(frozen=True, slots=True)
class Event:
    """One event of MAVLink's events interface."""

    id: int
    """Component and hash of the name."""
    levels: int
    """Log levels: internal in the high half, external in the low half."""
    arguments: bytes
    """As the event's definition lays them out."""


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Contents of HEARTBEAT."""

    vehicle_type: int
    autopilot: int
    base_mode: int
    custom_mode: int
    system_status: int


@dataclass(frozen=True, slots=True)
class SensorHealth:
    """The three bit sets of SYS_STATUS."""

    present: int
    enabled: int
    health: int


@dataclass(frozen=True, slots=True)
class ModeInfo:
    """One row of the table behind AVAILABLE_MODES."""

    custom_mode: int
    standard_mode: int
    properties: int
    name: str


@dataclass(frozen=True, slots=True)
class PositionTarget:
    """What the position controller is after; None where it is after nothing.  World ENU."""

    position_enu_m: Vector3 | None
    velocity_enu_m_s: Vector3 | None
    acceleration_enu_m_s2: Vector3 | None
    yaw_enu_rad: float


class Autopilot(Protocol):
    """One autopilot: it flies the vehicle and answers for its own state."""

    parameters: ParameterStore
    mission: MissionPlan
    battery: BatteryReport
    """What the battery says; set from outside."""

    def step(self, time_us: int, motion: Motion) -> RotorCommands:
        """Run one period of 4 ms and return the rotors' signals."""

    def receive_command(self, command: Command) -> Sequence[Acknowledgement] | None:
        """Carry out a command; None if this autopilot does not know it."""

    def receive_attitude_target(self, target: AttitudeTarget) -> None:
        """Take a setpoint."""

    def receive_position_setpoint(self, setpoint: PositionSetpoint) -> None:
        """Take a setpoint."""

    def receive_heartbeat(self, system_id: int) -> None:
        """A heartbeat of another system came in."""

    def receive_sticks(self, custom_mode: int) -> None:
        """A pilot is there from now on: the mode switch says this, sticks stand in the middle."""

    def note_reset(self, step: EstimateStep) -> None:
        """The estimator says that it has set its estimate anew: nobody is to fly after it."""

    def take_texts(self) -> Sequence[StatusText]:
        """Texts since the last call."""

    def take_events(self) -> Sequence[Event]:
        """Events since the last call; none where the flavour has no events interface."""

    def take_announcements(self) -> Sequence[Announcement]:
        """Messages to be sent on all links, since the last call."""

    @property
    def estimator(self) -> EstimatorState:
        """How far the estimator has got."""

    @property
    def estimate_interval_us(self) -> int:
        """How often its estimator publishes, µs: a multiple of 4000."""

    @property
    def heartbeat(self) -> Heartbeat:
        """Contents of HEARTBEAT."""

    @property
    def intended_custom_mode(self) -> int:
        """What the user asked for; in a failsafe it differs from what flies."""

    @property
    def standard_mode(self) -> int:
        """MAV_STANDARD_MODE of what flies."""

    @property
    def available_modes(self) -> Sequence[ModeInfo]:
        """Rows of AVAILABLE_MODES."""

    @property
    def sensor_health(self) -> SensorHealth:
        """The bit sets of SYS_STATUS."""

    @property
    def landed_state(self) -> int:
        """MAV_LANDED_STATE."""

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""

    @property
    def follows_setpoints(self) -> bool:
        """Whether it flies as a client's setpoints say."""

    @property
    def home_enu_m(self) -> Vector3 | None:
        """Home in the local frame, once it is known."""

    @property
    def home_attitude_flu_to_enu(self) -> Quaternion:
        """Attitude when home was set."""

    @property
    def attitude_setpoint(self) -> tuple[Quaternion, Vector3, float]:
        """Attitude FLU to ENU, rates FLU (rad/s) and collective thrust now commanded."""

    @property
    def position_target(self) -> PositionTarget | None:
        """What the position controller is after; None while it is idle."""

    @property
    def rotor_commands(self) -> RotorCommands:
        """Signals of the rotors, 0 to 1."""
