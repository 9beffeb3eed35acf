"""Plant files of the shim's vehicles, changed: what a controller must bear."""

import copy
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from companion.config.yaml_source import ConfigError
from companion.experiments.controller_file import write_whole
from companion.experiments.shim_files import shim_folder

_DUMPER = yaml.CSafeDumper if yaml.__with_libyaml__ else yaml.SafeDumper

PlantFile = dict[str, Any]
"""A plant file as YAML has it."""

Change = Callable[[PlantFile], None]
"""Changes a plant file in place.

Raises:
    ConfigError: the file lacks what is to be changed.
"""


def write_plant(vehicle: str, changes: Sequence[Change], path: Path) -> Path:
    """Write a shipped vehicle's plant file with changes.

    Args:
        vehicle: its name.
        changes: one after another.
        path: of the new file.

    Raises:
        ConfigError: the shim has no such vehicle, or a change does not apply to it.
        OSError: the file can't be written.
    """
    write_whole(path, plant_text(vehicle, changes))
    return path


def plant_text(vehicle: str, changes: Sequence[Change]) -> str:
    """A shipped vehicle's plant file with changes, as YAML.

    Args:
        vehicle: its name.
        changes: one after another.

    Raises:
        ConfigError: the shim has no such vehicle, or a change does not apply to it.
    """
    plant = copy.deepcopy(_read(vehicle))
    for change in changes:
        change(plant)
    return yaml.dump(plant, Dumper=_DUMPER, sort_keys=False)


def scaled(*keys: str, by: float) -> Change:
    """Multiplies a number, or each of a list, that stands below keys."""

    def change(plant: PlantFile) -> None:
        *parents, last = keys
        section = plant
        for parent in parents:
            section = section[parent]
        value = section[last]
        section[last] = [v * by for v in value] if isinstance(value, list) else value * by

    return change


def delayed(seconds: float) -> Change:
    """Adds a transport delay, half of it each way."""

    def change(plant: PlantFile) -> None:
        plant["telemetry_delay_s"] += seconds / 2.0
        plant["command_delay_s"] += seconds / 2.0

    return change


@cache
def _read(vehicle: str) -> PlantFile:
    path = shim_folder() / "plant" / "vehicles" / f"{vehicle}.yaml"
    try:
        plant: PlantFile = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"the shim has no vehicle {vehicle}.") from error
    return plant
