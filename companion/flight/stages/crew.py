"""What the stages of a flight work with, and what they keep of it."""

import math
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from companion.config.models import MissionConfig, YawConfig
from companion.control.reference_model import Array
from companion.flight.check.inspector import Inspector
from companion.flight.experiment import ExperimentFlight
from companion.flight.inbox import Inbox
from companion.flight.motion_capture import MotionCapture
from companion.flight.setpoints.placement import Placement
from companion.flight.setpoints.setpoint_stream import SetpointStream
from companion.flight.setpoints.timeline import Timeline
from companion.flight.stages.authority import Authority
from companion.flight.stages.mission_backend import MissionBackend
from companion.flight.stages.settings import Settings
from companion.flight.vehicle.connection import Connection
from companion.flight.voice import Voice
from companion.trajectories.trajectory import Trajectory


class FlightScope(Enum):
    """What of a flight the companion flies."""

    WHOLE = "from standing on the ground to standing on the ground"
    """The rule: the companion takes over no flight that it did not start."""
    AIRBORNE = "from holding in the air to the end of what is scored"
    """Of a simulated vehicle that was made to hold in the air; nothing comes after it."""


@dataclass(slots=True)
class Progress:
    """How far the flight has come."""

    timeline: Timeline | None = None
    """The reference of the last (or only) run over the trajectory."""
    home_m: Array = field(default_factory=lambda: np.full(3, np.nan))
    """(3,) where the first run began: above where the vehicle took off."""
    ground_up_m: float = math.nan
    """Height of the ground that it stood on, in the local frame."""
    placement: Placement | None = None
    """Where the mission lies; settled when it first engages."""
    completed: bool = False
    """The trajectory was flown to its end."""


@dataclass(frozen=True, slots=True)
class Flight:
    """What the stages of a flight work with."""

    mission: MissionConfig
    yaw: YawConfig
    trajectory: Trajectory
    connection: Connection
    stream: SetpointStream
    inbox: Inbox
    authority: Authority
    voice: Voice
    settings: Settings
    """The autopilot's parameters that the flight goes by."""
    backend: MissionBackend
    """Who asks for arming, take-off and landing."""
    scope: FlightScope = FlightScope.WHOLE
    inspector: Inspector | None = None
    """Looks the vehicle over before the flight; None for one that begins in the air."""
    progress: Progress = field(default_factory=Progress)
    mocap: MotionCapture | None = None
    """The poses that the autopilot is given; None if it needs none of ours."""
    experiment: ExperimentFlight | None = None
    """What is flown in the place of a controller; None in an ordinary flight."""
