"""Finding configuration files by name, and joining a mission with its vehicle and controller."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import companion
from companion.config.models import ControllerConfig, MissionConfig, VehicleConfig
from companion.config.yaml_source import (
    ConfigError,
    Source,
    parse_yaml,
    read_yaml,
    validate,
    with_settings,
)


@dataclass(frozen=True, slots=True)
class FlightConfig:
    """All that a flight is told."""

    mission: MissionConfig
    vehicle: VehicleConfig
    controller: ControllerConfig


def configs_folder() -> Path:
    """The shipped configurations: inside the installed package, or beside it in a checkout."""
    package = Path(companion.__file__).parent
    installed = package / "_configs"
    return installed if installed.is_dir() else package.parent / "configs"


def find_config(kind: str, name: str) -> Path:
    """Path of a shipped configuration by name, or of a file given by its path.

    Args:
        kind: folder below `configs`, for instance "vehicles".
        name: a name without suffix, or a path.

    Raises:
        ConfigError: there is none; the text lists the names that exist.
    """
    if name.endswith((".yaml", ".yml")):
        path = Path(name)
        if not path.is_file():
            raise ConfigError(f"{name}: no such file.")
        return path
    folder = configs_folder() / kind
    path = folder / f"{name}.yaml"
    if not path.is_file():
        known = ", ".join(sorted(p.stem for p in folder.glob("*.yaml"))) or "none"
        raise ConfigError(f"unknown {kind} '{name}'. Give a YAML file or one of: {known}.")
    return path


def controller_path(controller: str, vehicle: str) -> Path:
    """The controller's file for a vehicle: ``controllers/NAME/VEHICLE.yaml``, or a path."""
    if controller.endswith((".yaml", ".yml")):
        return find_config("controllers", controller)
    folder = configs_folder() / "controllers"
    known = sorted(p.name for p in folder.iterdir() if p.is_dir())
    if controller not in known:
        raise ConfigError(
            f"unknown controller '{controller}'. Give a YAML file or one of: {', '.join(known)}."
        )
    vehicle_name = Path(vehicle).stem
    path = folder / controller / f"{vehicle_name}.yaml"
    if not path.is_file():
        raise ConfigError(
            f"there is no '{controller}' for the vehicle '{vehicle_name}'. Give a controller's "
            "YAML file made for it: gains of one vehicle do not suit another."
        )
    return path


def load_flight(
    mission_file: Path | None, overrides: Mapping[str, object], settings: Mapping[str, str]
) -> FlightConfig:
    """Join a mission file (or the defaults), options of the command line, and ``--set`` values.

    Args:
        mission_file: YAML of a mission; None for the defaults.
        overrides: keys of the mission given as options; they win over the file.
        settings: dotted keys; those that begin with ``controller.`` or ``vehicle.`` go to the
            controller's and the vehicle's file, the others to the mission.

    Raises:
        ConfigError: whatever is wrong, with file, line, key and remedy.
    """
    source = read_yaml(mission_file) if mission_file else parse_yaml("", "mission")
    source = Source(source.name, {**source.data, **overrides}, source.lines)
    groups: dict[str, dict[str, str]] = {"mission": {}, "vehicle": {}, "controller": {}}
    for key, value in settings.items():
        head, _, rest = key.partition(".")
        if head in groups and rest:
            groups[head][rest] = value
        else:
            groups["mission"][key] = value
    mission = validate(MissionConfig, with_settings(source, groups["mission"]))
    vehicle_source = read_yaml(find_config("vehicles", mission.vehicle))
    vehicle = validate(VehicleConfig, with_settings(vehicle_source, groups["vehicle"]))
    controller_source = read_yaml(controller_path(mission.controller, mission.vehicle))
    controller = validate(ControllerConfig, with_settings(controller_source, groups["controller"]))
    return FlightConfig(mission, vehicle, controller)
