"""The shape of an autopilot's dialect."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from companion.mavlink.commands import Command
from companion.mavlink.messages import MessageId, Target


@dataclass(frozen=True, slots=True)
class Stream:
    """A message that the companion wants regularly."""

    message_id: MessageId
    interval_s: float
    required: bool
    """True if there is no flight without it."""


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
    """Modes to command, the first that works; empty: none is needed."""
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
        """Name for a person and for files: `px4`."""

    @property
    def autopilot_id(self) -> int:
        """MAV_AUTOPILOT in its heartbeats."""

    @property
    def streams(self) -> Sequence[Stream]:
        """What to ask for."""

    @property
    def parameter_encoding(self) -> ParameterEncoding:
        """How integers travel."""

    @property
    def hand_over(self) -> HandOver:
        """How to end a flight that the companion cannot end itself."""

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

    def readiness(self, present: int, enabled: int, health: int) -> Readiness:
        """Judge the three sensor masks of a SYS_STATUS."""
