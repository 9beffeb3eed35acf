"""One simulated flight of a study: what decides its result, and a name for just that."""

import hashlib
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import companion
from companion.config.resolve import FlightConfig, load_flight
from companion.config.yaml_source import ConfigError
from companion.experiments.shim_files import check_sensors, shim_folder
from companion.flight.embedded_shim import embedded_shim
from companion.flight.shim_process import ShimOptions

_DIGEST_LETTERS = 10
_NAMED_FILES = {"controller", "vehicle", "trajectory", "wind", "faults"}
"""Keys of a mission that name a file: its content decides, not its name."""
_NO_INFLUENCE = {
    "api",
    "cli",
    "commands",
    "config",
    "doctor",
    "experiments",
    "export",
    "identification",
    "live",
    "recording",
    "report",
    "theory",
}
"""Rooms of the companion whose code decides nothing of a simulated flight, but for the files
below; of `config` only what it makes of the files does."""
_DECIDING = (
    "experiments/flight_store.py",
    "experiments/flight_table.py",
    "experiments/fly_task.py",
    "experiments/memory_log.py",
    "frames.py",
    "lockstep.py",
    "report/flight_data.py",
    "report/metrics.py",
    "vehicle_state.py",
)
"""Of the flight, and of what is kept of it."""


@dataclass(frozen=True, slots=True)
class FlightTask:
    """A flight in lockstep."""

    controller: str
    """Name, or path of a YAML file."""
    trajectory: int | str
    """1 … 5, or a file."""
    wind: str = "calm"
    """Name or path of a scenario; "fan" is the one of the trajectory."""
    seed: int = 1
    vehicle: str = "bebop2"
    settings: tuple[tuple[str, str], ...] = ()
    """Dotted keys and YAML texts, as ``--set`` takes them."""
    sensors: str | None = None
    """A sensor profile of the shim in place of the vehicle's."""
    airborne: bool = True
    """Begin in the air at the trajectory's first point, and end when tracking is over."""
    shim_vehicle: str | None = None
    """Path of another plant file."""
    faults: str | None = None
    """What goes wrong on purpose: name or path of a file, or YAML that begins with a brace."""

    @property
    def key(self) -> str:
        """A name for the flight's result: stable, fit for a file, and of what decides the result.

        It changes with the content of every file that the flight reads and with the code that
        flies it, and not with where the files lie.

        Raises:
            ConfigError: the task can't be flown as it stands.
        """
        return _key(self, load_task(self))


@dataclass(frozen=True, slots=True)
class LoadedTask:
    """A task with its files read and checked."""

    config: FlightConfig
    shim: ShimOptions


def load_task(task: FlightTask) -> LoadedTask:
    """Read a task's files as `companion fly` does.

    Raises:
        ConfigError: whatever is wrong with them, with file, line, key and remedy.
    """
    settings = dict(task.settings)
    if len(settings) != len(task.settings):
        raise ConfigError(f"a key of {task.settings} is set twice. Leave one of them out.")
    overrides = {
        "controller": task.controller,
        "trajectory": task.trajectory,
        "wind": task.wind,
        "seed": task.seed,
        "vehicle": task.vehicle,
    }
    if task.faults is not None:
        overrides["faults"] = task.faults
    config = load_flight(None, overrides, settings)
    shim = embedded_shim(config)
    if task.shim_vehicle is not None:
        if not Path(task.shim_vehicle).is_file():
            raise ConfigError(f"{task.shim_vehicle}: no such plant file. Check the path.")
        shim = replace(shim, vehicle=task.shim_vehicle)
    if task.sensors is not None:
        shim = replace(shim, sensors=task.sensors)
    if shim.sensors is not None:
        check_sensors(shim.sensors)
    return LoadedTask(config, shim)


def _key(task: FlightTask, loaded: LoadedTask) -> str:
    config, shim = loaded.config, loaded.shim
    mission = config.mission.model_dump(mode="json", exclude=_NAMED_FILES)
    trajectory = config.mission.trajectory
    decides = {
        "code": code_digest(),
        "mission": mission,
        "vehicle": config.vehicle.model_dump(mode="json", exclude={"source"}),
        "controller": config.controller.model_dump(mode="json", exclude={"source"}),
        "others": {
            name: other.model_dump(mode="json", exclude={"source"})
            for name, other in sorted(config.others.items())
        },
        "trajectory": trajectory if isinstance(trajectory, int) else _file_digest(trajectory),
        "scenario": _file_digest(shim.scenario),
        "plant": shim.vehicle if task.shim_vehicle is None else _file_digest(shim.vehicle),
        "sensors": _content(task.sensors),
        "airborne": task.airborne,
        "faults": _faults(shim.faults),
    }
    text = json.dumps(decides, sort_keys=True, ensure_ascii=True)
    digest = hashlib.sha256(text.encode()).hexdigest()[:_DIGEST_LETTERS]
    path = "t" + (str(trajectory) if isinstance(trajectory, int) else _word(trajectory))
    vehicle = _word(task.vehicle if task.shim_vehicle is None else task.shim_vehicle)
    words = (_word(task.controller), vehicle, path, _word(task.wind), f"s{task.seed}", digest)
    return "-".join(words)


def _word(name: str) -> str:
    """A name or a path's last part, fit for a file's name."""
    stem = Path(name).stem if name.endswith((".yaml", ".yml", ".csv")) else name
    return re.sub(r"[^A-Za-z0-9_-]+", "_", stem)[:40]


def _content(name_or_path: str | None) -> str | None:
    """A name as it is; of a file its content."""
    if name_or_path is None or not name_or_path.endswith((".yaml", ".yml")):
        return name_or_path
    return _file_digest(name_or_path)


def _faults(told: str | None) -> str | None:
    """Faults themselves as they are; of a file its content."""
    return told if told is None or told.startswith("{") else _file_digest(told)


def _file_digest(path: str | Path) -> str:
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError as error:
        raise ConfigError(f"{path}: can't be read: {error.strerror or error}.") from error


@cache
def code_digest() -> str:
    """Digest of the code, and of the data inside the packages, that flies a simulated flight.

    A package's version alone would let a study in a checkout go on with figures of older code.
    """
    digest = hashlib.sha256()
    for name, path in _deciding_files():
        digest.update(name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _deciding_files() -> Iterator[tuple[str, Path]]:
    """Files of the two packages with their names, in a fixed order."""
    ours = Path(companion.__file__).parent
    skipped = {"__pycache__", "_configs", "_scenarios", "_faults"}
    roots = [p for p in sorted(ours.iterdir()) if p.is_dir() and p.name not in _NO_INFLUENCE]
    files = [ours / name for name in _DECIDING]
    roots.append(shim_folder())
    for root in roots:
        files += sorted(p for p in root.rglob("*") if p.suffix in (".py", ".yaml"))
    for path in files:
        if not skipped & set(path.parts):
            yield f"{path.parent.name}/{path.name}", path
