"""The shipped vehicles' files as data, to make another vehicle of."""

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from companion.api.errors import InputError
from companion.config.resolve import find_config
from companion.config.yaml_source import ConfigError, read_yaml
from companion.experiments.shim_files import shim_folder


def vehicle_of(name: str) -> dict[str, Any]:
    """What the companion is told of a shipped vehicle: the content of `configs/vehicles`.

    Args:
        name: "bebop2", "x500", "sih_quadx" or "arducopter".

    Raises:
        InputError: there is none of that name.
    """
    if not isinstance(name, str):
        raise InputError(f"{name!r} is no vehicle's name.")
    try:
        return copy.deepcopy(dict(read_yaml(find_config("vehicle", name)).data))
    except ConfigError as error:
        raise InputError(str(error)) from error


def plant_of(name: str) -> dict[str, Any]:
    """What a shipped vehicle is in the simulator: mass, rotors, drag, battery, parameters.

    Args:
        name: "bebop2", "x500", "sih_quadx" or "arducopter".

    Raises:
        InputError: there is none of that name.
    """
    folder = shim_folder() / "plant" / "vehicles"
    known = sorted(path.stem for path in folder.glob("*.yaml"))
    if name not in known:
        raise InputError(f"the simulator has no vehicle '{name}'. Give one of {', '.join(known)}.")
    try:
        return copy.deepcopy(dict(read_yaml(folder / f"{name}.yaml").data))
    except ConfigError as error:
        raise InputError(str(error)) from error


def write_yaml(path: str | Path, content: Mapping[str, Any]) -> Path:
    """Write such a content to a file, which `fly` and `companion fly` take.

    Args:
        path: of the file; one that exists is replaced.
        content: from `vehicle_of` or `plant_of`, changed.

    Returns:
        The path.

    Raises:
        OSError: it can't be written.
        InputError: something in it is no plain value.
    """
    try:
        text = yaml.safe_dump(dict(content), sort_keys=False, allow_unicode=True)
    except yaml.YAMLError as error:
        raise InputError(
            f"{path}: only numbers, texts, lists and mappings can be written: {error}."
        ) from error
    path = Path(path)
    path.write_text(text, encoding="utf-8")
    return path
