"""Scenario files: what blows, and what happens to the vehicle; and the wind made of them."""

from math import hypot
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator

from sitl_shim.data_file import DataModel, load_data_file, resolve_data_path
from sitl_shim.wind.dryden import DrydenGusts
from sitl_shim.wind.events import Load, Moments, Motor, Timed, check_order
from sitl_shim.wind.field import CALM, SteadyWind, SumOfWinds, Wind
from sitl_shim.wind.front import GustFront
from sitl_shim.wind.jet import FanJet

_PACKAGE = Path(__file__).parents[1]
_SEED_STREAM = 2

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Triple = tuple[float, float, float]


class Steady(DataModel):
    """A steady wind."""

    kind: Literal["steady"]
    velocity_enu_m_s: Triple
    """Of the air; it blows that way."""


class Gusts(DataModel):
    """Dryden gusts about the steady winds of the scenario."""

    kind: Literal["dryden"]
    intensity_m_s: NotNegative
    """Standard deviation of the horizontal components."""
    altitude_m: Positive
    """Above ground: sets the scale lengths."""
    passing_speed_m_s: Positive
    """Speed of the air past the vehicle: scale length over it is the correlation time."""
    direction_enu: Triple
    """Of the mean wind."""

    @field_validator("direction_enu")
    @classmethod
    def _horizontal(cls, value: Triple) -> Triple:
        if hypot(value[0], value[1]) < 1e-6:
            raise ValueError("the direction needs a horizontal part")
        return value


class Jet(DataModel):
    """A fan's jet (see `sitl_shim.wind.jet.FanJet`)."""

    kind: Literal["jet"]
    crossing_enu_m: Triple
    """Where its axis crosses the path."""
    direction_enu: Triple
    """It blows that way; of any length."""
    fan_distance_m: Positive
    """From the fan to the crossing."""
    peak_m_s: NotNegative
    """Mean speed on the axis."""
    width_m: Positive
    """Standard deviation of the profile across, a Gaussian."""
    turbulence: NotNegative
    """Rms of the fluctuating velocity over the local mean speed."""
    correlation_time_s: Positive
    """Of the turbulence."""

    @field_validator("direction_enu")
    @classmethod
    def _some_direction(cls, value: Triple) -> Triple:
        if hypot(*value) < 1e-6:
            raise ValueError("the direction may not be zero")
        return value


class Front(Timed):
    """A gust front: from a moment on, a wind that rises and stays (see `GustFront`)."""

    kind: Literal["front"]
    velocity_enu_m_s: Triple
    """Of the air once it has risen."""
    rise_s: Positive
    """From calm to the whole velocity."""


class Scenario(DataModel):
    """What the air does, and what happens to the vehicle."""

    name: str
    """For a person."""
    winds: tuple[Annotated[Steady | Gusts | Jet | Front, Field(discriminator="kind")], ...]
    """All of them at once; none is calm."""
    payload: tuple[Load, ...] = ()
    """What the vehicle carries when, by rising time; nothing before the first."""
    motors: tuple[Motor, ...] = ()
    """How strong its motors are when, by rising time; sound before the first."""

    @field_validator("payload")
    @classmethod
    def _one_after_another(cls, loads: tuple[Load, ...]) -> tuple[Load, ...]:
        check_order(loads, at_once=False)
        return loads

    @field_validator("motors")
    @classmethod
    def _in_order(cls, motors: tuple[Motor, ...]) -> tuple[Motor, ...]:
        check_order(motors, at_once=True)
        return motors


def scenario_path(name_or_path: str | Path) -> Path:
    """The file of a scenario that is given by name or by path.

    Raises:
        DataFileError: there is no scenario of that name.
    """
    installed = _PACKAGE / "_scenarios"
    folder = installed if installed.is_dir() else _PACKAGE.parent / "configs" / "scenarios"
    return resolve_data_path(name_or_path, folder, "scenario")


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Load a scenario by its name (``calm``, ``fan-4``, ...) or from a YAML file.

    Raises:
        DataFileError: a `ValueError` that names the file, the key and the remedy.
    """
    return load_data_file(scenario_path(name_or_path), Scenario, "scenario")


def make_wind(scenario: Scenario, seed: int, moments: Moments | None = None) -> Wind:
    """The wind of a scenario; the same for the same seed.

    Args:
        scenario: its file's content.
        seed: draws what is random.
        moments: what the times of fronts count from; by default setpoints never come.
    """
    moments = moments or Moments()
    winds = [_make_part(part, seed, index, moments) for index, part in enumerate(scenario.winds)]
    if not winds:
        return CALM
    return winds[0] if len(winds) == 1 else SumOfWinds(winds)


def _make_part(part: Steady | Gusts | Jet | Front, seed: int, index: int, moments: Moments) -> Wind:
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_SEED_STREAM, index)))
    if isinstance(part, Steady):
        return SteadyWind(part.velocity_enu_m_s)
    if isinstance(part, Front):
        return GustFront(part.velocity_enu_m_s, part, part.rise_s, moments)
    if isinstance(part, Gusts):
        return DrydenGusts(
            intensity_m_s=part.intensity_m_s,
            altitude_m=part.altitude_m,
            passing_speed_m_s=part.passing_speed_m_s,
            direction_enu=part.direction_enu,
            generator=generator,
        )
    return FanJet(
        crossing_enu_m=part.crossing_enu_m,
        direction_enu=part.direction_enu,
        fan_distance_m=part.fan_distance_m,
        peak_m_s=part.peak_m_s,
        width_m=part.width_m,
        turbulence=part.turbulence,
        correlation_time_s=part.correlation_time_s,
        generator=generator,
    )
