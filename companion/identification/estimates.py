"""What an identification finds, each figure with its 95 % interval."""

from dataclasses import dataclass

from companion.config.models import NoiseConfig
from companion.identification.recording import Array

_LEAST_NOISE = 1e-9
"""A noiseless recording (of a simulation with exact sensors) still needs positive figures."""


class UnidentifiedError(Exception):
    """A recording does not tell what is asked of it; the text says what to do about it."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A figure with its interval."""

    value: float
    half_width_95: float
    """The truth is within value ± this in 95 of 100 flights; half of what is between the ends where
    `ends_95` states these."""
    unit: str
    ends_95: tuple[float, float] | None = None
    """Where the interval is not symmetric about the value: of a size that can't be negative."""

    @property
    def low(self) -> float:
        """Lower end of the interval."""
        return self.value - self.half_width_95 if self.ends_95 is None else self.ends_95[0]

    @property
    def high(self) -> float:
        """Upper end of the interval."""
        return self.value + self.half_width_95 if self.ends_95 is None else self.ends_95[1]


@dataclass(frozen=True, slots=True)
class Response:
    """``gain · ωn² e^(-T s) / (s² + 2 ζ ωn s + ωn²)`` from a command to what it commands."""

    natural_frequency_rad_s: Estimate
    damping: Estimate
    dead_time_s: Estimate
    """T, in all: from the time of the sample on which a command was decided until it begins to
    show.  The vehicle's own part is this less the loop's delay, and no less than 0."""
    gain: Estimate


@dataclass(frozen=True, slots=True)
class NoiseEstimates:
    """The reported state's scatter; per axis ENU, one sigma."""

    position_m: tuple[Estimate, Estimate, Estimate]
    """White part."""
    velocity_m_s: tuple[Estimate, Estimate, Estimate]
    """White part."""
    acceleration_m_s2_sqrt_hz: tuple[Estimate, Estimate, Estimate]
    """Density of the unexplained acceleration (two-sided: the variance of a velocity that only it
    drives grows by its square per second)."""
    tilt_rad: Estimate
    """White part of roll and pitch, each."""

    def config(self) -> NoiseConfig:
        """As the vehicle's file holds them."""

        def three(axes: tuple[Estimate, Estimate, Estimate]) -> tuple[float, float, float]:
            x, y, z = (max(axis.value, _LEAST_NOISE) for axis in axes)
            return (x, y, z)

        return NoiseConfig(
            position_m=three(self.position_m),
            velocity_m_s=three(self.velocity_m_s),
            acceleration_m_s2_sqrt_hz=three(self.acceleration_m_s2_sqrt_hz),
            tilt_rad=max(self.tilt_rad.value, _LEAST_NOISE),
        )


@dataclass(frozen=True, slots=True)
class FittedCurve:
    """A part of the recording with what the identified model makes of its commands."""

    name: str
    """roll, pitch, lift, climb, x or y."""
    quantity: str
    """What is drawn, for an axis label, with its unit."""
    time_s: Array
    """(n,) the autopilot's."""
    measured: Array
    """(n,)"""
    fitted: Array
    """(n,); what `measured` has beyond it is the residual."""
    commanded: Array
    """(n,) in the unit of `measured`, NaN where a command has none."""


@dataclass(frozen=True, slots=True)
class Identified:
    """A vehicle as its identification flight shows it."""

    roll: Response
    pitch: Response
    """Tilt command to reported tilt."""
    tilt_gain: Estimate
    """Horizontal acceleration over g times the tangent of the reported tilt."""
    lift: Response | None
    """Force share of the thrust field to vertical acceleration, of which a gain of 1 is
    g / hover thrust; None where the field is a climb rate."""
    climb: Response
    """Climb-rate command to climb rate: with the companion's thrust loop of default gains, or
    where the field is a climb rate, with the autopilot's."""
    linear_drag_1_s: Estimate
    """k1 of the horizontal drag ``k1 v + k2 v |v|`` per mass."""
    quadratic_drag_1_m: Estimate
    """k2."""
    hover_thrust: Estimate | None
    """The thrust field at hover, 0..1; None where the field is a climb rate and the autopilot
    does not report its thrust."""
    loop_delay_s: Estimate
    """From a sample's time until its setpoint acts."""
    loop_delay_jitter_s: Estimate
    """Standard deviation of it from sample to sample."""
    noise_estimates: NoiseEstimates
    trim_roll_rad: Estimate
    """Reported roll at which nothing pushes sideways."""
    trim_pitch_rad: Estimate
    """The same of pitch."""
    curves: tuple[FittedCurve, ...]

    @property
    def noise(self) -> NoiseConfig:
        """The noise as the vehicle's file holds it."""
        return self.noise_estimates.config()
