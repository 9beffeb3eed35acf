"""The shape of an autopilot's dialect."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from companion.mavlink.commands import Command
from companion.mavlink.messages import MessageId, Target
from companion.thrust_meaning import ThrustMeaning

PREARM_CHECK = 0x1000_0000
"""MAV_SYS_STATUS_PREARM_CHECK: set in `health` once the autopilot would arm."""

_SENSORS: dict[int, str] = {
    0x1: "gyroscope",
    0x2: "accelerometer",
    0x4: "magnetometer",
    0x8: "barometer",
    0x10: "airspeed sensor",
    0x20: "GPS",
    0x40: "optical flow",
    0x80: "vision position",
    0x1000: "yaw position control",
    0x4000: "altitude and position control",
    0x8000: "motors",
    0x1_0000: "remote control",
    0x10_0000: "geofence",
    0x20_0000: "attitude and position estimate",
    0x100_0000: "logging",
    0x200_0000: "battery",
}
"""MAV_SYS_STATUS_SENSOR bits that a person can do something about."""


@dataclass(frozen=True, slots=True)
class Stream:
    """A message that the companion wants regularly."""

    message_id: MessageId
    interval_s: float
    required: bool
    """True if there is no flight without it."""


@dataclass(frozen=True, slots=True)
class ReadinessFacts:
    """What the vehicle has said that tells whether it would arm."""

    custom_mode: int | None
    """The mode that it reported last; None if it has not yet."""
    sensors: tuple[int, int, int] | None
    """Masks present, enabled, health of the newest SYS_STATUS; None before the first."""
    sensors_of_mode: bool
    """That SYS_STATUS came after the mode was first reported: what it says is of this mode."""
    estimator_flags: int | None
    """Of the newest EKF_STATUS_REPORT; None before the first."""
    position_arrives: bool
    """Usable samples of the state keep coming."""


@dataclass(frozen=True, slots=True)
class Readiness:
    """Whether the autopilot would arm, and if not, why."""

    ready: bool
    missing: tuple[str, ...]
    """What is not well, in words; empty when ready."""


@dataclass(frozen=True, slots=True)
class HandOver:
    """How to give the vehicle back to the autopilot."""

    modes: tuple[str, ...]
    """Modes to command, the next one if the autopilot refuses one; empty: none is needed."""
    explanation: str
    """What the vehicle then does, for a person."""


class ParameterEncoding(Enum):
    """How integer parameters travel in PARAM_VALUE's float."""

    BYTEWISE = "bytewise"
    C_CAST = "c cast"


class AutopilotDialect(Protocol):
    """Everything the flight needs to know about one kind of autopilot."""

    @property
    def name(self) -> str:
        """Name for a person's options and for files: `px4`."""

    @property
    def title(self) -> str:
        """As its makers write it: `PX4`."""

    @property
    def autopilot_id(self) -> int:
        """MAV_AUTOPILOT in its heartbeats."""

    @property
    def streams(self) -> Sequence[Stream]:
        """What to ask for; the state at the mission's rate in place of the interval here."""

    @property
    def stream_remedy(self) -> str:
        """What to do about a stream that comes too slowly, for a person."""

    @property
    def state_before_position(self) -> bool:
        """True if the state streams from the boot on, before the estimator has a position."""

    @property
    def parameter_encoding(self) -> ParameterEncoding:
        """How integers travel."""

    @property
    def flight_parameters(self) -> tuple[str, ...]:
        """What to read before a flight; an autopilot need not have all of them."""

    def thrust_meaning(self, parameters: Mapping[str, float]) -> ThrustMeaning | str:
        """What the thrust field means with these parameters, or why it cannot be flown."""

    def setpoint_timeout_s(self, parameters: Mapping[str, float]) -> float:
        """After so long without a setpoint the autopilot acts by itself, s of its own clock."""

    def takeoff_height_m(self, parameters: Mapping[str, float], wanted_m: float) -> float:
        """How high a take-off goes if this height is wanted."""

    @property
    def hand_over(self) -> HandOver:
        """How to end a flight that the companion cannot end itself."""

    @property
    def mode_before_arming(self) -> str | None:
        """The mode to arm in, asked for and verified; None if any will do."""

    @property
    def arms_in_setpoint_mode(self) -> bool:
        """True if it can be armed under an idle stream of attitudes, without any position."""

    @property
    def takeoff_modes(self) -> tuple[str, ...]:
        """Modes of a take-off in their order; in the last one it holds."""

    @property
    def setpoint_mode(self) -> str:
        """Name of the mode in which setpoints are obeyed."""

    @property
    def stream_before_mode_s(self) -> float:
        """How long setpoints must flow before that mode is asked for."""

    def custom_mode(self, name: str) -> int:
        """The `custom_mode` of a mode; KeyError names the known ones."""

    def mode_name(self, custom_mode: int) -> str:
        """The name of a `custom_mode`, or a description of an unknown one."""

    def set_mode(self, target: Target, name: str) -> Command:
        """The command that asks for a mode."""

    def takeoff(self, target: Target, height_m: float) -> Command:
        """The command that takes off from where the vehicle stands."""

    def readiness(self, facts: ReadinessFacts) -> Readiness:
        """Judge whether the autopilot would arm."""


def unwell_sensors(sensors: tuple[int, int, int]) -> tuple[str, ...]:
    """Names of what is present and enabled and not healthy.

    Args:
        sensors: masks present, enabled, health of a SYS_STATUS.
    """
    present, enabled, health = sensors
    unwell = present & enabled & ~health
    return tuple(label for bit, label in _SENSORS.items() if unwell & bit)
