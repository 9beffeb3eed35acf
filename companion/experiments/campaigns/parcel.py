"""A flight packed for another machine: its configuration, and what its files hold.

What a name stands for here may be something else there, and a path of here is none there.  So the
configuration travels as it was read, and scenario, plant, faults, sensors and trajectory as the
text of their files.  What stays is the program: it must be the same, which its digest says.
"""

import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from companion.config.resolve import FlightConfig
from companion.experiments.campaign import Job
from companion.experiments.campaigns.manifest import libraries
from companion.experiments.flight_store import Summary, flight_bytes, summarise
from companion.experiments.flight_task import FlightTask, LoadedTask, code_digest, load_task
from companion.experiments.fly_task import fly_loaded_task
from companion.experiments.provenance import version
from companion.flight.shim_process import ShimOptions

_FILES = (".yaml", ".yml", ".csv")


class StrangerError(RuntimeError):
    """A worker's program is another one."""


@dataclass(frozen=True, slots=True)
class PackedFile:
    """A file that a flight reads."""

    name: str
    content: bytes


@dataclass(frozen=True, slots=True)
class Parcel:
    """All that a worker needs, beside the program."""

    key: str
    task: FlightTask
    config: FlightConfig
    shim: ShimOptions
    files: tuple[tuple[str, PackedFile], ...]
    """By what reads them: trajectory, scenario, vehicle, sensors, faults."""
    keep: bool
    program: tuple[tuple[str, str], ...]
    """What must be the same there; see `program`."""


Flown = tuple[Summary, bytes | None]
"""The figures, and the flight's file if it is to be kept."""


def program() -> tuple[tuple[str, str], ...]:
    """What decides a flight's figures to the last digit, beside its files.

    Compiled code is not among it: it gives the same bits.
    """
    return (
        ("companion", version()),
        ("code", code_digest()[:12]),
        ("python", f"{sys.version_info.major}.{sys.version_info.minor}"),
        *((name, found) for name, found in libraries().items() if name != "numba"),
    )


def differences(
    ours: tuple[tuple[str, str], ...], theirs: tuple[tuple[str, str], ...]
) -> list[str]:
    """What two programs differ in, for a person; empty if they are the same."""
    here, there = dict(ours), dict(theirs)
    return [
        f"{name} {there.get(name, 'missing')} there, {here.get(name, 'missing')} here"
        for name in dict.fromkeys((*here, *there))
        if here.get(name) != there.get(name)
    ]


def pack(job: Job) -> Parcel:
    """Pack a flight.

    Raises:
        ConfigError: its files can't be used.
        OSError: one can't be read.
    """
    loaded = load_task(job.task)
    read = {"trajectory": loaded.config.mission.trajectory} | {
        name: getattr(loaded.shim, name) for name in ("scenario", "vehicle", "sensors", "faults")
    }
    files = tuple(
        (name, PackedFile(Path(value).name, Path(value).read_bytes()))
        for name, value in read.items()
        if _is_file(value)
    )
    return Parcel(job.key, job.task, loaded.config, loaded.shim, files, job.keep, program())


def fly_parcel(parcel: Parcel) -> Flown:
    """What a worker of a cluster does.

    Raises:
        StrangerError: the worker's program is not the one that packed it.
        TrajectoryFileError: its trajectory can't be used.
        ShimRefusedError: the shim can't simulate it.
        OSError: its files can't be laid out.
    """
    found = differences(parcel.program, program())
    if found:
        raise StrangerError(f"the worker's program is another one: {'; '.join(found)}")
    with tempfile.TemporaryDirectory(prefix="companion-flight-") as folder:
        table, _ = fly_loaded_task(parcel.task, _unpacked(parcel, Path(folder)))
    kept = flight_bytes(parcel.key, table) if parcel.keep else None
    return summarise(parcel.key, table), kept


def _unpacked(parcel: Parcel, folder: Path) -> LoadedTask:
    """The flight's configuration, naming its files where they lie now."""
    paths: dict[str, Any] = {}
    for name, file in parcel.files:
        (folder / name).mkdir()
        path = folder / name / file.name
        path.write_bytes(file.content)
        paths[name] = path if name == "scenario" else str(path)
    config = parcel.config
    if "trajectory" in paths:
        mission = config.mission.model_copy(update={"trajectory": paths.pop("trajectory")})
        config = replace(config, mission=mission)
    return LoadedTask(config, replace(parcel.shim, **paths))


def _is_file(value: object) -> bool:
    if isinstance(value, Path):
        return True
    return isinstance(value, str) and not value.startswith("{") and value.endswith(_FILES)
