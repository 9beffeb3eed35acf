"""Scenario files: the winds that blow and what the vehicle carries; and the wind made of them."""

from itertools import pairwise
from math import hypot
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator

from sitl_shim.data_file import DataModel, load_data_file, resolve_data_path
from sitl_shim.wind.dryden import DrydenGusts
from sitl_shim.wind.field import CALM, SteadyWind, SumOfWinds, Wind
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
    direction_enu: Triple
    fan_distance_m: Positive
    peak_m_s: NotNegative
    width_m: Positive
    turbulence: NotNegative
    correlation_time_s: Positive

    @field_validator("direction_enu")
    @classmethod
    def _some_direction(cls, value: Triple) -> Triple:
        if hypot(*value) < 1e-6:
            raise ValueError("the direction may not be zero")
        return value


class Load(DataModel):
    """The mass that the vehicle carries from a moment on."""

    at_s: NotNegative
    """Simulated time since boot."""
    mass_kg: float
    """Beside the vehicle's own; it replaces the load before, and 0 releases it.  Less than 0: a
    part of the vehicle is gone."""


class Scenario(DataModel):
    """What the air does, and what happens to the vehicle's mass."""

    name: str
    winds: tuple[Annotated[Steady | Gusts | Jet, Field(discriminator="kind")], ...]
    """All of them at once; none is calm."""
    payload: tuple[Load, ...] = ()
    """What the vehicle carries when, by rising time; nothing before the first."""

    @field_validator("payload")
    @classmethod
    def _in_order(cls, loads: tuple[Load, ...]) -> tuple[Load, ...]:
        for earlier, later in pairwise(loads):
            if later.at_s <= earlier.at_s:
                raise ValueError(
                    f"the times at_s must rise, and {later.at_s:g} s comes after {earlier.at_s:g} s"
                )
        return loads


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


def make_wind(scenario: Scenario, seed: int) -> Wind:
    """The wind of a scenario; the same for the same seed."""
    winds = [_make_part(part, seed, index) for index, part in enumerate(scenario.winds)]
    if not winds:
        return CALM
    return winds[0] if len(winds) == 1 else SumOfWinds(winds)


def _make_part(part: Steady | Gusts | Jet, seed: int, index: int) -> Wind:
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_SEED_STREAM, index)))
    if isinstance(part, Steady):
        return SteadyWind(part.velocity_enu_m_s)
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
