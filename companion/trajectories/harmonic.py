"""The five test trajectories: sums of sinusoids of a ramped time.

Each is written as ``centre + Σ amplitude · sin(frequency · s + phase)`` per axis, with
``cos x = sin(x + π/2)`` and, for the rose, the product of two cosines as a sum.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from companion.trajectories.smooth_time import (
    RAMP_S,
    ramped,
    ramped_time,
    ramped_time_at,
)
from companion.trajectories.trajectory import Array, Motion

_QUARTER = math.pi / 2


@dataclass(frozen=True, slots=True)
class Harmonic:
    """One sinusoid of the path time s."""

    amplitude_m: tuple[float, float, float]
    frequency_rad_s: float
    phase_rad: float


@dataclass(frozen=True, slots=True)
class HarmonicTrajectory:
    """A trajectory made of sinusoids; scored from 0 to `scored_s`, at rest two seconds later."""

    name: str
    centre_m: tuple[float, float, float]
    harmonics: tuple[Harmonic, ...]
    scored_s: float = 20.0
    _arrays: tuple[Array, Array, Array, Array] = field(init=False, repr=False, compare=False)
    """Frequencies (k,), phases (k,), amplitudes (k, 3) and the centre (3,)."""

    def __post_init__(self) -> None:
        """Keep the harmonics as arrays."""
        frequencies = np.array([h.frequency_rad_s for h in self.harmonics])
        phases = np.array([h.phase_rad for h in self.harmonics])
        amplitudes = np.array([h.amplitude_m for h in self.harmonics]).reshape(-1, 3)
        arrays = (frequencies, phases, amplitudes, np.array(self.centre_m))
        object.__setattr__(self, "_arrays", arrays)

    @property
    def end_s(self) -> float:
        """Time at which it has come to rest, s."""
        return self.scored_s + RAMP_S

    def position(self, times_s: Array) -> Array:
        """Desired positions (samples, 3) in metres, ENU."""
        frequencies, phases, amplitudes, centre = self._arrays
        angles = ramped_time(times_s, self.scored_s)[:, None] * frequencies + phases
        position: Array = np.sin(angles) @ amplitudes + centre
        return position

    def position_at(self, time_s: float) -> tuple[float, float, float]:
        """Desired position at one time, ENU m: in plain floats, which is several times quicker."""
        s = ramped_time_at(time_s, self.scored_s)
        x, y, z = self.centre_m
        for h in self.harmonics:
            swing = math.sin(h.frequency_rad_s * s + h.phase_rad)
            along_x, along_y, along_z = h.amplitude_m
            x, y, z = x + along_x * swing, y + along_y * swing, z + along_z * swing
        return x, y, z

    def motion(self, times_s: Array) -> Motion:
        """Desired positions, velocities and accelerations (samples, 3), ENU."""
        s, rate, curvature = ramped(times_s, self.scored_s)
        along = np.zeros((len(s), 3))
        bend = np.zeros((len(s), 3))
        for h in self.harmonics:
            angle = h.frequency_rad_s * s + h.phase_rad
            amplitude = np.array(h.amplitude_m)
            along += (h.frequency_rad_s * np.cos(angle))[:, None] * amplitude
            bend -= (h.frequency_rad_s**2 * np.sin(angle))[:, None] * amplitude
        return Motion(
            self.position(times_s),
            along * rate[:, None],
            bend * (rate**2)[:, None] + along * curvature[:, None],
        )


_TILT = math.radians(25.0)

TEST_TRAJECTORIES: dict[int, HarmonicTrajectory] = {
    1: HarmonicTrajectory(
        "1 line", (0.0, 0.0, 1.2), (Harmonic((-1.0, -0.6, -0.25), 0.67, _QUARTER),)
    ),
    2: HarmonicTrajectory(
        "2 circle",
        (0.0, 0.0, 1.2),
        (Harmonic((1.0, 0.0, 0.0), 1.0, _QUARTER), Harmonic((0.0, 1.0, 0.0), 1.0, 0.0)),
    ),
    3: HarmonicTrajectory(
        "3 tilted ellipse",
        (0.0, 0.0, 1.2),
        (
            Harmonic((1.2 * math.cos(_TILT), 0.0, 1.2 * math.sin(_TILT)), 1.1, _QUARTER),
            Harmonic((0.0, 0.8, 0.0), 1.1, 0.0),
        ),
    ),
    4: HarmonicTrajectory(
        "4 figure-eight",
        (0.0, 0.0, 1.2),
        (
            Harmonic((1.2, 0.0, 0.0), 0.8, 0.0),
            Harmonic((0.0, 0.9, 0.0), 1.6, 0.0),
            Harmonic((0.0, 0.0, 0.35), 0.8, 0.7),
        ),
    ),
    5: HarmonicTrajectory(
        "5 rose",
        (0.0, 0.0, 1.2),
        (
            Harmonic((0.6, 0.0, 0.0), 2.2, _QUARTER),
            Harmonic((0.6, 0.0, 0.0), 1.1, _QUARTER),
            Harmonic((0.0, 0.6, 0.0), 2.2, 0.0),
            Harmonic((0.0, -0.6, 0.0), 1.1, 0.0),
            Harmonic((0.0, 0.0, 0.4), 1.1, 0.0),
        ),
    ),
}
"""The five test trajectories, by number, of rising difficulty in a volume of 3 × 3 × 2 m."""
