"""Sensor profiles as data: how far an estimator's output is from the truth."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from sitl_shim.data_file import DataModel, load_data_file, resolve_data_path

_PROFILES = Path(__file__).parent / "profiles"

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Triple = tuple[float, float, float]
NotNegativeTriple = tuple[NotNegative, NotNegative, NotNegative]


class Drift(DataModel):
    """Slow error of position and velocity, as of an estimator that leans on GNSS.

    On each axis the position error is a randomly driven, damped oscillator, and the velocity
    error is its exact derivative.  Its natural frequency is the quotient of the deviations.
    """

    position_m: tuple[Positive, Positive, Positive]
    """Standard deviation, ENU."""
    velocity_m_s: tuple[Positive, Positive, Positive]
    """Standard deviation, ENU."""
    damping: Positive
    """Damping ratio."""


class AttitudeError(DataModel):
    """Estimated less true attitude: roll and pitch about the body's axes (FLU), yaw about up."""

    bias_deg: Triple
    """Roll, pitch, yaw: constant, the same for every seed."""
    bias_spread_deg: NotNegativeTriple
    """A further constant, drawn by seed uniformly within plus or minus this."""
    wander_deg: NotNegativeTriple
    """Standard deviation of a slow part (first-order Gauss-Markov)."""
    wander_time_s: Positive
    """Correlation time of the slow part."""
    noise_deg: NotNegativeTriple
    """Standard deviation of a white part, new in each update."""
    with_trim: bool = True
    """Whether the vehicle's trim comes on top: a constant of roll and pitch, drawn by seed."""


class SensorProfile(DataModel):
    """Errors of an autopilot's state estimate."""

    name: str
    pose_rate_hz: NotNegative
    """Position and velocity are new this often, and held between; 0: in each update."""
    pose_delay_s: Annotated[float, Field(ge=0.0, le=1.0)]
    """Position and velocity are this old; 0: of the present."""
    position_noise_m: NotNegativeTriple
    """Standard deviation of the white part, ENU, new with each sample."""
    velocity_noise_m_s: NotNegativeTriple
    """Standard deviation of the white part, ENU, new with each sample."""
    drift: Drift | None
    """The slow part of position and velocity; null: none."""
    attitude: AttitudeError
    rate_noise_rad_s: NotNegativeTriple
    """Standard deviation, FLU, white."""
    rate_bias_spread_rad_s: NotNegativeTriple
    """A constant, FLU, drawn by seed uniformly within plus or minus this."""
    acceleration_noise_m_s2: NotNegativeTriple
    """Standard deviation, ENU, white."""


def load_profile(name_or_path: str | Path) -> SensorProfile:
    """Load a profile by its name (``mocap``, ``gnss``, ``exact``) or from a YAML file.

    Raises:
        DataFileError: a `ValueError` that names the file, the key and the remedy.
    """
    path = resolve_data_path(name_or_path, _PROFILES, "sensor profile")
    return load_data_file(path, SensorProfile, "sensor profile")
