"""What is known of a flight that was hurt: its own records, and the simulation's truth.

All times are of the companion's clock (the log's): the truth arrives as it happens, whatever the
link does to other packets, and this clock neither jumps nor starts anew.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.experiments.faults.wire_log import Commanded
from companion.mavlink.commands import CommandId

Array = NDArray[np.float64]
_ARM = CommandId.COMPONENT_ARM_DISARM


@dataclass(frozen=True, slots=True)
class Begun:
    """A fault's beginning, as the truth tells it."""

    time_s: float
    name: str
    value: float


@dataclass(frozen=True, slots=True)
class Said:
    """What a person was told."""

    time_s: float
    severity: str
    """info, warning or error."""
    text: str


@dataclass(frozen=True, slots=True)
class Sent:
    """The setpoints that left, one row each."""

    time_s: Array
    finite: NDArray[np.bool_]
    tilt_rad: Array
    """Of the attitude that was asked for; 0 of body rates."""
    thrust: Array
    rate_rad_s: Array
    """Magnitude of the body rates that were asked for; 0 of an attitude."""
    state_age_s: Array
    """Since a state arrived that was newer than all before it."""


@dataclass(frozen=True, slots=True)
class TruePath:
    """Where the vehicle truly was, one row a sample, about 100 a second."""

    time_s: Array
    position_enu_m: Array
    velocity_enu_m_s: Array
    tilt_rad: Array


@dataclass(frozen=True, slots=True)
class Tracked:
    """The reference and how far the vehicle truly was from it, one row a tick that had one."""

    time_s: Array
    error_m: Array
    scored: NDArray[np.bool_]
    """While the trajectory itself was flown."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """A flight."""

    outcome: str
    """By the companion: landed, aborted or refused."""
    completed: bool
    note: str
    begun: tuple[Begun, ...]
    said: tuple[Said, ...]
    phases: tuple[tuple[float, str], ...]
    """When each began."""
    sent: Sent
    path: TruePath
    tracked: Tracked
    taken_over_s: float | None
    """When the companion could first know that the vehicle had left the mode of setpoints."""
    others_s: float | None
    """When it could first know that the vehicle was in a mode that it had not commanded."""
    commands: tuple[Commanded, ...]
    armed_s: float | None
    """When the companion could first know that the vehicle was armed."""
    disarmed_s: float | None
    """When the companion could first know that the vehicle was disarmed, after it was armed."""
    ended_s: float
    """When the companion's flight was over."""

    @property
    def arm_commands_s(self) -> tuple[float, ...]:
        """When arming was commanded."""
        return tuple(c.time_s for c in self.commands if c.command_id == _ARM and c.params[0] == 1.0)
