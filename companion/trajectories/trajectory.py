"""What every desired trajectory is."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Motion:
    """Samples of a desired motion, ENU; each array is (samples, 3)."""

    position_m: Array
    """m."""
    velocity_m_s: Array
    """m/s."""
    acceleration_m_s2: Array
    """m/s², without gravity."""


class Trajectory(Protocol):
    """A desired position over time, defined (at rest) before 0 and after its end too."""

    @property
    def name(self) -> str:
        """Name for people."""
        ...

    @property
    def scored_s(self) -> float:
        """Tracking error is scored from 0 to this time, s."""
        ...

    @property
    def end_s(self) -> float:
        """From this time on the trajectory rests, s; at least `scored_s`."""
        ...

    def position(self, times_s: Array) -> Array:
        """Desired positions (samples, 3) in metres, ENU."""
        ...

    def position_at(self, time_s: float) -> tuple[float, float, float]:
        """Desired position at one time, ENU m; what is asked for at every sample of the state."""
        ...

    def motion(self, times_s: Array) -> Motion:
        """Desired positions with velocity and acceleration."""
        ...
