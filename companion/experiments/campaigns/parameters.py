"""What a parameter of a campaign may be called, and what it does to a flight."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from companion.config.models import MissionConfig
from companion.experiments.attitude_lag import attitude_lag
from companion.experiments.campaigns.models import BaseConfig, Value
from companion.experiments.perturbed_plant import Change, delayed, scaled

FLIGHT = ("controller", "trajectory", "wind", "autopilot", "faults", "sensors", "seed", "vehicle")
"""Parameters that are keys of the base."""
LABELS = ("controller", "trajectory", "wind", "autopilot", "faults", "sensors", "vehicle")
"""Those whose values are names, whatever they look like: a trajectory's number measures nothing."""
NAMED = ("controller", "trajectory", "wind", "faults", "sensors", "vehicle")
"""Those whose values may be files."""
_NOT_HERE = {"connect", "link", "mocap", "preflight", "switch"}
"""Keys of a mission that a study of simulated flights has no use for."""
_PLAIN = sorted(set(MissionConfig.model_fields).difference(FLIGHT, _NOT_HERE))
_HEADS = sorted(
    {"controller", "vehicle"}.union(set(MissionConfig.model_fields).difference(_NOT_HERE))
)
NO_FAULTS = "none"
_ONE_LINE = 1_000_000


@dataclass(frozen=True, slots=True)
class PlantParameter:
    """A way in which the simulated vehicle differs from the one that the companion knows."""

    says: str
    nominal: float
    low: float
    high: float
    """Within these, both included, it is a vehicle."""
    changes: Callable[[float], tuple[Change, ...]]
    unit: str | None = None


PLANT = {
    "plant.mass": PlantParameter(
        "factor on the mass", 1.0, 0.1, 10.0, lambda by: (scaled("mass_kg", by=by),)
    ),
    "plant.thrust": PlantParameter(
        "factor on the rotors' thrust",
        1.0,
        0.1,
        10.0,
        lambda by: (scaled("propulsion", "max_thrust_n", by=by),),
    ),
    "plant.attitude_lag": PlantParameter(
        "factor on the attitude's lag", 1.0, 0.1, 10.0, lambda by: (attitude_lag(by),)
    ),
    "plant.delay_s": PlantParameter(
        "transport delay beside the vehicle's own, half of it each way",
        0.0,
        0.0,
        1.0,
        lambda seconds: (delayed(seconds),),
        "s",
    ),
    "plant.drag": PlantParameter(
        "factor on both parts of the drag",
        1.0,
        0.0,
        100.0,
        lambda by: tuple(
            scaled("drag", name, by=by) for name in ("linear_n_s_m", "quadratic_n_s2_m2")
        ),
    ),
}
"""By name, in the order in which they are applied."""


def fault_of_name(name: str) -> str | None:
    """What is wrong with a parameter's name, with the remedy; None: nothing."""
    if name in FLIGHT or name in PLANT or name in _PLAIN:
        return None
    head, dot, rest = name.partition(".")
    if dot and head == "plant":
        return f"there is no '{name}'. The plant's parameters are {', '.join(PLANT)}."
    if dot and rest and head in _HEADS:
        return None
    if head in _NOT_HERE:
        return f"'{name}' has no place in a study of simulated flights. Remove it."
    return (
        f"there is no parameter '{name}'. Give one of {', '.join((*FLIGHT, *PLANT))}, or a key as "
        "--set takes it (controller.mpc.horizon, vehicle.mass_kg, supervisor.state_age_limit_s, "
        f"{', '.join(_PLAIN)})."
    )


def fault_of_value(name: str, value: Value) -> str | None:
    """What is wrong with a value, as far as its name alone tells; None: nothing."""
    if name in PLANT:
        wanted = PLANT[name]
        if isinstance(value, bool) or not isinstance(value, int | float):
            return f"a number is expected (given: {value!r})"
        if not wanted.low <= value <= wanted.high:
            return (
                f"{value:g} is no {wanted.says}: give {wanted.low:g} … {wanted.high:g}, "
                f"{wanted.nominal:g} is the vehicle as it is"
            )
    if name == "seed" and (isinstance(value, bool) or not isinstance(value, int) or value < 0):
        return f"a seed is a whole number from 0 (given: {value!r})"
    if name in ("controller", "wind", "vehicle", "autopilot") and not isinstance(value, str):
        return f"a name or a YAML file is expected (given: {value!r})"
    return None


def nominal(name: str, base: BaseConfig) -> Value:
    """A parameter's value in the flight that the campaign is built on; None: not known here."""
    if name in PLANT:
        return PLANT[name].nominal
    if name in FLIGHT:
        value: Value = getattr(base, name)
        return label(value) if name in LABELS else value
    stated = base.settings.get(name)
    return stated if isinstance(stated, str | bool | int | float) else None


def label(value: Value) -> str:
    """A choice as a word in a table."""
    if value is None:
        return NO_FAULTS
    return value if isinstance(value, str) else yaml_text(value)


def plant_changes(values: Mapping[str, Value]) -> tuple[Change, ...]:
    """What is changed in the plant file, for a point's values; nothing for nominal ones."""
    found: list[Change] = []
    for name, parameter in PLANT.items():
        value = values.get(name)
        if isinstance(value, int | float) and value != parameter.nominal:
            found += parameter.changes(float(value))
    return tuple(found)


def settings_of_point(base: BaseConfig, values: Mapping[str, Value]) -> tuple[tuple[str, str], ...]:
    """Dotted keys and YAML texts, as a `FlightTask` has them."""
    settings: dict[str, Any] = dict(base.settings)
    autopilot = values.get("autopilot", base.autopilot)
    if autopilot != "auto":
        settings["autopilot"] = autopilot
    settings |= {n: v for n, v in values.items() if n not in FLIGHT and n not in PLANT}
    return tuple((name, yaml_text(value)) for name, value in settings.items())


def yaml_text(value: object) -> str:
    """A value as YAML on one line; floats with all their digits."""
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        return yaml.safe_dump(value, width=_ONE_LINE).removesuffix("\n").removesuffix("\n...")
    text: str = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=_ONE_LINE)
    return text.removesuffix("\n").removesuffix("\n...")
