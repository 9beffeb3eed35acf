"""Rest over one point for a while: what a hover, or an experiment about one, is flown along."""

from dataclasses import dataclass

import numpy as np

from companion.trajectories.trajectory import Array, Motion


@dataclass(frozen=True, slots=True)
class Rest:
    """Rest at a height over the origin."""

    name: str
    height_m: float
    duration_s: float

    @property
    def scored_s(self) -> float:
        """All of it."""
        return self.duration_s

    @property
    def end_s(self) -> float:
        """All of it."""
        return self.duration_s

    def position(self, times_s: Array) -> Array:
        """Desired positions (samples, 3), ENU m."""
        return np.tile(np.array((0.0, 0.0, self.height_m)), (len(times_s), 1))

    def position_at(self, time_s: float) -> tuple[float, float, float]:
        """The same at one time."""
        return (0.0, 0.0, self.height_m)

    def motion(self, times_s: Array) -> Motion:
        """The same, at rest."""
        rest = np.zeros((len(times_s), 3))
        return Motion(self.position(times_s), rest, rest)
