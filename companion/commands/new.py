"""What ``companion new`` does: write a commented file to begin with."""

import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from companion.config.describe import KeyDescription, describe
from companion.config.folders import schema_path
from companion.config.models import (
    FRAMEWORK_SECTIONS,
    ControllerConfig,
    MissionConfig,
    VehicleConfig,
)
from companion.config.resolve import controller_path, find_config
from companion.config.template import template
from companion.config.yaml_source import ConfigError, read_yaml
from companion.experiments.campaigns.models import CampaignConfig

KINDS = ("mission", "controller", "vehicle", "trajectory", "scenario", "faults", "campaign")
MODELINE = "yaml-language-server: $schema="
_YAML = (".yaml", ".yml")
_HOW = (
    "A line that begins with # and no space is a key with its default, or an example: take the #",
    "away, and that of the section above it, to set it.",
)
_CAMPAIGN: dict[str, Any] = {
    "name": "mine",
    "says": "How much of what may be different a controller bears.",
    "keep": "figures",
    "base": {"controller": "mpc-l1", "trajectory": 4, "vehicle": "bebop2"},
    "sample": {"method": "sobol", "points": 16},
    "parameters": {
        "plant.mass": {"low": 0.8, "high": 1.2},
        "plant.delay_s": {"low": 0.0, "high": 0.03},
        "wind": ["calm", "fan"],
    },
    "seeds": 1,
}
_LOOP = (
    (0, -0.8, 0.0, 1.2),
    (2, 0.0, 0.6, 1.4),
    (4, 0.8, 0.0, 1.6),
    (6, 0.0, -0.6, 1.4),
    (8, -0.8, 0.0, 1.2),
)


@dataclass(frozen=True, slots=True)
class NewRequest:
    """The options of the command line."""

    kind: str
    file: Path | None = None
    """By default KIND.yaml, here."""
    trajectory: int | str | None = None
    """Of a mission; a file is given from where one is."""
    controller: str | None = None
    vehicle: str | None = None
    """Of a mission, or the vehicle that a controller is for."""
    wind: str | None = None
    base: str | None = None
    """The shipped file that the values are taken from."""


def run_new(request: NewRequest) -> Path:
    """Write the file; it is told, with the command that uses it.

    Returns:
        Its path.

    Raises:
        ConfigError: the kind or what it is to be made from is unknown, an option does not belong
            to it, or the file is there already.
        OSError: it can't be written.
    """
    if request.kind not in KINDS:
        raise ConfigError(f"unknown kind '{request.kind}'. Give one of: {', '.join(KINDS)}.")
    _refuse_unheeded(request)
    path = request.file or Path(f"{request.kind}.yaml")
    suffixes = (*_YAML, ".csv") if request.kind == "trajectory" else _YAML
    if path.suffix not in suffixes:
        raise ConfigError(f"{path}: give a file that ends in {' or '.join(suffixes)}.")
    text, usage = _MAKERS[request.kind](request, path)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError as error:
        raise ConfigError(
            f"{path} is there already, and is not overwritten. Give another name, or remove it."
        ) from error
    sys.stdout.write(f"{path} is written. Edit it, then:\n\n  {usage}\n")
    return path


def _refuse_unheeded(request: NewRequest) -> None:
    heeded = {
        "mission": {"--traj", "--controller", "--vehicle", "--wind"},
        "controller": {"--vehicle", "--from"},
        "trajectory": set[str](),
    }.get(request.kind, {"--from"})
    given = {
        "--traj": request.trajectory,
        "--controller": request.controller,
        "--vehicle": request.vehicle,
        "--wind": request.wind,
        "--from": request.base,
    }
    for option, value in given.items():
        if value is not None and option not in heeded:
            able = f" It heeds {', '.join(sorted(heeded))}." if heeded else ""
            raise ConfigError(f"{option} says nothing of a new {request.kind}: leave it out.{able}")


def _mission(request: NewRequest, path: Path) -> tuple[str, str]:
    vehicle = "bebop2" if request.vehicle is None else request.vehicle
    controller = "mpc-l1" if request.controller is None else request.controller
    usage = f"companion fly --mission {path} --lockstep"
    values: dict[str, Any] = {
        "trajectory": _from(path, 4 if request.trajectory is None else request.trajectory),
        "controller": _from(path, controller),
        "vehicle": _from(path, vehicle),
        "wind": _from(path, "calm" if request.wind is None else request.wind),
        "seed": 1,
    }
    find_config("vehicle", vehicle)
    if not controller.endswith(_YAML) and not vehicle.endswith(_YAML):
        controller_path(controller, vehicle)
    head = (
        _modeline("mission"),
        "A mission: what is flown, with what, and within which bounds.",
        "",
        f"  {usage}    simulated, in seconds",
        f"  companion fly --mission {path}               simulated, in real time",
        "",
        *_HOW,
        "Options of the command line and --set KEY=VALUE win over this file. Names of files are",
        "relative to this one's folder. World frame: x east, y north, z up; metres, seconds.",
    )
    return template(describe(MissionConfig), values, head), usage


def _controller(request: NewRequest, path: Path) -> tuple[str, str]:
    vehicle = "bebop2" if request.vehicle is None else request.vehicle
    base = "mpc-l1" if request.base is None else request.base
    values = read_yaml(controller_path(base, vehicle)).data
    framework = values["framework"]
    theirs = {section for sections in FRAMEWORK_SECTIONS.values() for section in sections}
    own = FRAMEWORK_SECTIONS[framework]

    def shown(key: KeyDescription) -> bool:
        return key.name not in theirs or key.name in own

    usage = f"companion fly --controller {path} --vehicle {vehicle} --lockstep"
    head = (
        _modeline("controller"),
        f"A controller for {vehicle}, with the gains of the shipped {base}.",
        "",
        f"  {usage}",
        f"  companion compare {base} {path} --vehicle {vehicle} --traj 4 --seeds 1",
        "",
        *_HOW,
        "Values per axis are x, y, z.",
    )
    return template(describe(ControllerConfig), values, head, shown), usage


def _vehicle(request: NewRequest, path: Path) -> tuple[str, str]:
    base = "bebop2" if request.base is None else request.base
    values = read_yaml(find_config("vehicle", base)).data
    usage = f"companion fly --vehicle {path} --lockstep"
    head = (
        _modeline("vehicle"),
        f"What is known of a vehicle, with the figures of the shipped {base}. `companion identify`",
        "writes such a file from a minute in the air.",
        "",
        f"  {usage}",
        "",
        *_HOW,
    )
    return template(describe(VehicleConfig), values, head), usage


def _campaign(request: NewRequest, path: Path) -> tuple[str, str]:
    values = _CAMPAIGN
    if request.base is not None:
        return _copied("campaign", "campaign", request.base, f"companion campaign {path}")
    usage = f"companion campaign {path}"
    head = (
        _modeline("campaign"),
        "A campaign: many simulated flights over sampled parameters.",
        "",
        f"  {usage}",
        f"  companion report campaigns/{values['name']}",
        "",
        *_HOW,
    )
    return template(describe(CampaignConfig), values, head), usage


def _trajectory(_: NewRequest, path: Path) -> tuple[str, str]:
    usage = f"companion fly --traj {path} --lockstep"
    if path.suffix == ".csv":
        rows = "".join(",".join(str(value) for value in point) + "\n" for point in _LOOP)
        return f"t,x,y,z\n{rows}", usage
    points = "".join(f"  - [{', '.join(str(value) for value in point)}]\n" for point in _LOOP)
    head = (
        _modeline("trajectory"),
        "A trajectory: timed points, joined by a smooth curve that starts and ends at rest.",
        "",
        f"  {usage}",
        "",
        "Each point: [t, x, y, z]; seconds that rise by 0.01 at least, and metres: x east,",
        "y north, z up, from the place of take-off. It must fit the vehicle's limits and the",
        "geofence, or nothing is armed.",
    )
    text = "\n".join(f"# {line}".rstrip() for line in head)
    return f"{text}\n\nname: {path.stem}\npoints:\n{points}", usage


def _scenario(request: NewRequest, path: Path) -> tuple[str, str]:
    base = "gusts" if request.base is None else request.base
    return _copied("scenario", "scenario", base, f"companion fly --wind {path} --lockstep")


def _faults(request: NewRequest, path: Path) -> tuple[str, str]:
    base = "bad-link" if request.base is None else request.base
    return _copied("fault", "faults", base, f"companion fly --faults {path} --lockstep")


def _copied(folder: str, kind: str, base: str, usage: str) -> tuple[str, str]:
    """A shipped file with its comments, which points at its schema from where it now is."""
    text = find_config(folder, base).read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if MODELINE not in line]
    return "\n".join((f"# {_modeline(kind)}", *lines)) + "\n", usage


def _modeline(kind: str) -> str:
    """What tells an editor which schema a file follows."""
    return f"{MODELINE}{schema_path(kind).absolute().as_posix()}"


def _from(path: Path, value: int | str) -> int | str:
    """A file's name as the new file must say it: from its own folder."""
    if isinstance(value, int) or not value.endswith((*_YAML, ".csv")):
        return value
    return Path(os.path.relpath(value, path.parent)).as_posix()


_MAKERS: Mapping[str, Callable[[NewRequest, Path], tuple[str, str]]] = {
    "mission": _mission,
    "controller": _controller,
    "vehicle": _vehicle,
    "trajectory": _trajectory,
    "scenario": _scenario,
    "faults": _faults,
    "campaign": _campaign,
}
