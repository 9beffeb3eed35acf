"""Finding configuration files by name, and joining a mission with its vehicle and controller."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from companion.config.folders import configs_folder as configs_folder
from companion.config.folders import shipped_names as shipped_names
from companion.config.models import ControllerConfig, MissionConfig, VehicleConfig
from companion.config.relief import ROBUST, switch_from, with_reliefs
from companion.config.validation import validate
from companion.config.yaml_source import (
    ConfigError,
    Source,
    parse_yaml,
    read_yaml,
    with_options,
    with_settings,
)

_SUFFIXES = (".yaml", ".yml")
_OPTIONS = {"trajectory": "--traj"}


@dataclass(frozen=True, slots=True)
class FlightConfig:
    """All that a flight is told."""

    mission: MissionConfig
    vehicle: VehicleConfig
    controller: ControllerConfig
    others: Mapping[str, ControllerConfig] = field(default_factory=dict)
    """Controllers that the flight may be handed over to: fallbacks, by what `fallback` says, and
    those of planned hand-overs, by what the mission calls them."""


def find_config(kind: str, name: str, also: Iterable[str] = ()) -> Path:
    """Path of a shipped configuration by name, or of a file given by its path.

    Args:
        kind: what it is: "vehicle" for the folder `configs/vehicles`, and so on.
        name: a name without suffix, or a path.
        also: names without a file of their own that a user may give, for the message.

    Raises:
        ConfigError: there is none; the text lists the names that exist.
    """
    if name.endswith(_SUFFIXES):
        return _existing_file(name)
    known = shipped_names(kind)
    if name not in known:
        raise _unknown(kind, name, [*known, *also])
    return configs_folder() / f"{kind}s" / f"{name}.yaml"


def controller_path(controller: str, vehicle: str) -> Path:
    """The controller's file for a vehicle: ``controllers/NAME/VEHICLE.yaml``, or a path.

    Args:
        controller: its name, or a path.
        vehicle: name of the vehicle that it must suit.

    Raises:
        ConfigError: there is none; the text lists the names that exist.
    """
    if controller.endswith(_SUFFIXES):
        return _existing_file(controller)
    shipped = {p.name: p for p in (configs_folder() / "controllers").iterdir() if p.is_dir()}
    if controller not in shipped:
        raise _unknown("controller", controller, shipped)
    suited = {path.stem: path for path in shipped[controller].glob("*.yaml")}
    if vehicle not in suited:
        raise ConfigError(
            f"there is no '{controller}' for the vehicle '{vehicle}', only for "
            f"{', '.join(sorted(suited))}. Give a controller's YAML file made for it: gains of "
            "one vehicle do not suit another."
        )
    return suited[vehicle]


def _existing_file(name: str) -> Path:
    path = Path(name)
    try:
        found = path.is_file()
    except OSError:
        found = False
    if not found:
        raise ConfigError(f"{name}: no such file. Check the path.")
    return path


def _unknown(kind: str, name: str, known: Iterable[str]) -> ConfigError:
    return ConfigError(
        f"unknown {kind} '{name}'. Give a YAML file or one of: {', '.join(sorted(known))}."
    )


def load_flight(
    mission_file: Path | None, overrides: Mapping[str, object], settings: Mapping[str, str]
) -> FlightConfig:
    """Join a mission file (or the defaults), options of the command line, and ``--set`` values.

    Paths that stand in the mission file are relative to its folder; those of the command line are
    relative to where one is.

    Args:
        mission_file: YAML of a mission; None for the defaults.
        overrides: keys of the mission given as options; they win over the file.
        settings: dotted keys; those that begin with ``controller.`` or ``vehicle.`` go to the
            controller's and the vehicle's file, the others to the mission.

    Raises:
        ConfigError: whatever is wrong, with file, line, key and remedy.
    """
    source = _read_mission(mission_file) if mission_file else parse_yaml("", "mission")
    source = with_options(source, overrides, _OPTIONS)
    groups: dict[str, dict[str, str]] = {"mission": {}, "vehicle": {}, "controller": {}}
    for key, value in settings.items():
        head, _, rest = key.partition(".")
        if head in groups and rest:
            groups[head][rest] = value
        else:
            groups["mission"][key] = value
    mission = validate(MissionConfig, with_settings(source, groups["mission"]))
    vehicle = validate(
        VehicleConfig,
        with_settings(
            read_yaml(find_config("vehicle", mission.vehicle)), groups["vehicle"], "vehicle."
        ),
    )
    controller = validate(
        ControllerConfig,
        with_settings(
            read_yaml(controller_path(mission.controller, vehicle.name)),
            groups["controller"],
            "controller.",
        ),
    )

    def read(name: str) -> ControllerConfig:
        return validate(ControllerConfig, read_yaml(controller_path(name, vehicle.name)))

    shipped = configs_folder() / "controllers" / ROBUST / f"{vehicle.name}.yaml"
    controller, others = with_reliefs(mission, controller, read, robust=shipped.is_file())
    return FlightConfig(mission, vehicle, controller, others)


def _read_mission(path: Path) -> Source:
    """The mission with its paths made relative to where one is."""
    source = read_yaml(path)
    data = dict(source.data)
    for key in ("trajectory", "vehicle", "controller", "wind", "faults", "sensors", "plant"):
        value = data.get(key)
        if isinstance(value, str) and value and (key == "trajectory" or value.endswith(_SUFFIXES)):
            data[key] = str(path.parent / value)
    if isinstance(data.get("switch"), list):
        data["switch"] = [switch_from(value, path.parent) for value in data["switch"]]
    _make_relative(data, ("link", "signing", "key_file"), path.parent)
    return Source(source.name, data, source.lines)


def _make_relative(data: dict[str, Any], path: tuple[str, ...], folder: Path) -> None:
    """Put a folder before a file's name that stands below keys, if it is there."""
    *parents, last = path
    section: Any = data
    for key in parents:
        inner = section.get(key)
        if not isinstance(inner, dict):
            return
        section[key] = section = dict(inner)
    if isinstance(section.get(last), str) and section[last]:
        section[last] = str(folder / section[last])
