"""What a flight was told, and by which program, as the first record of its log."""

import hashlib
import json
import platform
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import companion
from companion.config.models import ControllerConfig, MissionConfig, VehicleConfig
from companion.config.resolve import FlightConfig

_LIBRARIES = ("numpy", "scipy", "osqp", "pymavlink")
_ROOMS = ("config", "control", "flight", "mavlink", "trajectories")
"""Whose code makes setpoints of packets."""


def configuration_record(config: FlightConfig, *, replayable: bool) -> dict[str, Any]:
    """The record; `FlightConfig` comes back from it by `recorded_configuration`.

    Args:
        config: of the flight.
        replayable: False if the setpoints follow from more than what is recorded.
    """
    return {
        "mission": _plain(config.mission),
        "vehicle": _plain(config.vehicle),
        "controller": _plain(config.controller),
        "others": {name: _plain(other) for name, other in config.others.items()},
        "trajectory_file": _trajectory_text(config.mission),
        "replayable": replayable,
        "made_by": made_by(),
    }


def recorded_configuration(values: dict[str, Any]) -> FlightConfig:
    """The configuration back from its record.

    Raises:
        KeyError: a part is missing.
        pydantic.ValidationError: this version knows no such configuration.
    """
    return FlightConfig(
        MissionConfig.model_validate_json(json.dumps(values["mission"])),
        VehicleConfig.model_validate_json(json.dumps(values["vehicle"])),
        ControllerConfig.model_validate_json(json.dumps(values["controller"])),
        {
            name: ControllerConfig.model_validate_json(json.dumps(other))
            for name, other in values["others"].items()
        },
    )


@cache
def made_by() -> dict[str, str]:
    """Versions and machine: where all of them are the same, so are the setpoints' bits."""
    versions = {name: metadata.version(name) for name in _LIBRARIES}
    return {
        "companion": _version(),
        "code": _code_digest(),
        "python": platform.python_version(),
        **versions,
        "machine": platform.machine(),
        "system": platform.system(),
    }


def _version() -> str:
    try:
        return metadata.version("companion")
    except metadata.PackageNotFoundError:  # run from a checkout that is not installed
        return "unknown"


def _code_digest() -> str:
    """Of the rooms whose code decides, so that a changed checkout is told from the other."""
    digest = hashlib.sha256()
    package = Path(companion.__file__).parent
    files = [package / "frames.py", package / "vehicle_state.py", package / "thrust_meaning.py"]
    for room in _ROOMS:
        files += sorted((package / room).rglob("*.py"))
    for path in files:
        digest.update(str(path.relative_to(package)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _plain(section: MissionConfig | VehicleConfig | ControllerConfig) -> dict[str, Any]:
    return section.model_dump(mode="json")


def _trajectory_text(mission: MissionConfig) -> str:
    if isinstance(mission.trajectory, int):
        return ""
    path = Path(mission.trajectory)  # an experiment's name is no file
    return path.read_text(encoding="utf-8") if path.is_file() else ""
