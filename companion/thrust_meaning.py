"""What an autopilot makes of the thrust field of an attitude or body-rate setpoint."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class ThrustMeaning:
    """What 0…1 in the thrust field asks for."""

    kind: Literal["collective", "vertical", "climb_rate"]
    """`collective`: thrust along the body's vertical, the sender compensates tilt (PX4, and
    ArduPilot with GUID_OPTIONS 8 and ATC_ANGLE_BOOST 0).  `vertical`: the same, but the autopilot
    divides by the cosine of the tilt itself (ArduPilot with GUID_OPTIONS 8).  `climb_rate`:
    0.5 holds the altitude, 0 and 1 are the largest rates down and up (ArduPilot's default)."""
    climb_m_s: float = 0.0
    """`climb_rate` only: the rate that 1 asks for."""
    descent_m_s: float = 0.0
    """`climb_rate` only: the rate that 0 asks for, positive."""


COLLECTIVE = ThrustMeaning("collective")
