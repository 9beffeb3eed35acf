"""What is known before a flight: of the vehicle as it was found, and of what is planned."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from companion.thrust_meaning import ThrustMeaning


@dataclass(frozen=True, slots=True)
class Identity:
    """Who answers, and how it stands."""

    autopilot: str
    """`px4`, `ardupilot`."""
    version: str
    """Of its software, such as `1.17.0`; empty if it did not say."""
    capabilities: int | None
    """MAV_PROTOCOL_CAPABILITY; None if it did not say."""
    system_id: int
    component_id: int
    mode: str
    armed: bool
    landed_state: int
    """MAV_LANDED_STATE; 0 if it did not say."""
    other_vehicles: tuple[str, ...] = ()
    """Further vehicles on the link, described."""
    other_senders: tuple[str, ...] = ()
    """Everybody else on the link, described."""


@dataclass(frozen=True, slots=True)
class StreamFacts:
    """One message that was asked for, as it came."""

    name: str
    asked_hz: float
    measured_hz: float
    """Mean over the time of measurement; 0 if none came."""
    longest_gap_s: float
    """Longest time without one; of the whole measurement if none came."""
    jitter_s: float
    """Standard deviation of the intervals; NaN of fewer than three."""
    count: int
    window_s: float
    """How long was measured."""
    is_state: bool = False
    """The vehicle's state, on which every setpoint rests."""
    required: bool = False


@dataclass(frozen=True, slots=True)
class LinkFacts:
    """The way to the vehicle and back."""

    description: str
    round_trips_s: tuple[float, ...]
    """Of TIMESYNC, oldest first; empty if it was never answered."""
    clock_offset_s: float = math.nan
    """The autopilot's clock minus ours."""
    clock_rate: float = 1.0
    """Seconds of the autopilot's clock per second of ours."""
    received: int = 0
    lost: int = 0
    """Of the vehicle's packets, by their sequence numbers."""
    local: bool = False
    """It does not leave this computer."""
    we_sign: bool = False
    vehicle_signs: bool = False
    rejected: int = 0
    """Packets that were not taken because of their signature."""


@dataclass(frozen=True, slots=True)
class BatteryFacts:
    """The battery as SYS_STATUS has it."""

    remaining: float
    """0..1; NaN if the autopilot does not know."""
    voltage_v: float
    """NaN if the autopilot does not know."""


@dataclass(frozen=True, slots=True)
class EstimatorFacts:
    """What the autopilot says of its own estimate."""

    flags: int | None
    """ESTIMATOR_STATUS_FLAGS; None if it did not say."""
    ratios: Mapping[str, float] = field(default_factory=dict)
    """Innovation test ratios by name (1: what is measured is about to be rejected)."""
    home: bool | None = None
    """A home position is set; None if nobody asked."""
    ready: bool | None = None
    """It would arm; None if that cannot be told in this mode."""
    missing: tuple[str, ...] = ()
    """What it waits for."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What is to be flown, as far as a check needs it."""

    our_system_id: int
    setpoint: Literal["attitude", "rates"]
    state_rate_hz: float
    state_age_limit_s: float
    hover_thrust: float
    tilt_limit_deg: float
    climb_limit_m_s: float
    descent_limit_m_s: float
    loop_delay_s: float | None
    """What the vehicle's file says of the delay there and back; None if nothing."""
    problems: tuple[str, ...]
    """What of the trajectory does not fit the vehicle or our geofence, in sentences."""
    reach_m: float
    """How far the trajectory goes from where the vehicle takes off, horizontally."""
    height_m: float
    """How high it goes above where the vehicle stands."""
    controller: str = ""
    """Its name or file; empty if it is not to be told."""
    vehicle: str = ""
    """The same."""
    certifiable: bool = False
    """The controller has an L1 part, so that `companion certify` has something to say."""
    mocap: bool = False
    """Poses of motion capture are sent to the autopilot."""
    battery_refuse_below: float = 0.15
    battery_warn_below: float = 0.35
    thrust_field: Literal["any", "thrust", "climb_rate"] = "any"
    """What the thrust field is wanted to mean."""


@dataclass(frozen=True, slots=True)
class Facts:
    """All that was gathered."""

    identity: Identity
    streams: tuple[StreamFacts, ...]
    link: LinkFacts
    parameters: Mapping[str, float]
    """Those that the autopilot has, of those that were asked for."""
    thrust: ThrustMeaning | str
    """What it makes of the thrust field; a text says why that cannot be flown."""
    battery: BatteryFacts
    estimator: EstimatorFacts
    stream_remedy: str = ""
    """What to do about a stream that is slow on this autopilot, without a full stop."""
