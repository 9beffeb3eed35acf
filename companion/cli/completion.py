"""Values that the shell completes: trajectories, shipped names, files, logs, keys of ``--set``.

Each function here is what typer calls for a parameter: it takes what is typed so far and gives the
values, some with a word of help, which zsh and fish show.  It is called at each press of the
tabulator key, so that nothing heavy is imported: names are those of folders and files.  What is
not completed here (paths in other folders) the shell completes by itself, as files.
"""

import json
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from companion.config.folders import (
    configs_folder,
    schema_path,
    shipped_controllers,
    shipped_names,
)

Offer = str | tuple[str, str]
"""A value, or a value and what it is."""
Complete = Callable[[], list[Offer]]

TRAJECTORIES = {"1": "line", "2": "circle", "3": "tilted ellipse", "4": "figure-eight", "5": "rose"}
AUTOPILOTS = {"px4": "PX4", "ardupilot": "ArduPilot", "auto": "by its heartbeat"}
SETPOINTS = {"attitude": "attitude and thrust", "rates": "body rates and thrust"}
SENSORS = {
    "mocap": "motion capture",
    "gnss": "satellite navigation",
    "ekf3": "ArduPilot's estimator",
    "exact": "without errors",
}
MOCAP_SYSTEMS = {
    "udp": "JSON on a port",
    "vicon": "",
    "optitrack": "",
    "qualisys": "",
    "vrpn": "",
}
PERTURBATIONS = (
    "all",
    "lag+25",
    "lag-25",
    "slow+25",
    "mass+20",
    "mass-20",
    "thrust+15",
    "thrust-15",
    "dragx2",
    "delay+20ms",
    "loss10",
    "lag+50",
    "slow+50",
    "delay+40ms",
    "combo",
)
SWITCHES = {"l1-off": "adaptation off", "l1-on": "adaptation on"}
TUNED = ("pid-l1", "lqr-l1", "pid", "mpc-pid")
PARTS = {"gains": "", "model": "of mpc-pid's MPC", "whole": "of mpc-pid, with its MPC"}
CERTIFIED_BY = ("l1:", "plus:")
"""A controller's file has one of these sections if a certificate can be made of it."""

_YAML = (".yaml", ".yml")
_MOST_FILES = 200


def trajectories(incomplete: str) -> list[Offer]:
    """The numbers of the test trajectories, and files of this folder."""
    return [*TRAJECTORIES.items(), *_files(incomplete, (".csv", *_YAML))]


def trajectory_lists(incomplete: str) -> list[Offer]:
    """The same, after a comma too: ``1,2,`` goes on with 3, 4, 5."""
    before, comma, _ = incomplete.rpartition(",")
    taken = set(before.split(","))
    return [
        (f"{before}{comma}{number}", what)
        for number, what in TRAJECTORIES.items()
        if number not in taken
    ]


def controllers(incomplete: str) -> list[Offer]:
    """The shipped controllers, and files of this folder."""
    return [*shipped_controllers(), *_files(incomplete, _YAML)]


def certifiable(incomplete: str) -> list[Offer]:
    """The shipped controllers that `companion certify` knows the theory of."""
    folder = configs_folder() / "controllers"
    known = [name for name in shipped_controllers() if _is_certifiable(folder / name)]
    return [*known, *_files(incomplete, _YAML)]


def contenders(incomplete: str) -> list[Offer]:
    """Controllers of a comparison: ``LABEL=NAME`` is one, too, and so is ``NAME@VEHICLE.yaml``."""
    flown, at, path = incomplete.rpartition("@")
    if at:
        return [f"{flown}@{file}" for file in _files(path, _YAML)]
    label, equals, _ = incomplete.rpartition("=")
    return [f"{label}{equals}{_value(offer)}" for offer in controllers(incomplete)]


def switches(incomplete: str) -> list[Offer]:
    """After ``t=SECONDS:`` a controller's name, or l1-off and l1-on."""
    when, colon, _ = incomplete.partition(":")
    if not colon:
        return ["t="] if "t=".startswith(incomplete) else []
    to: list[Offer] = [*SWITCHES.items(), *shipped_controllers()]
    return [
        (f"{when}:{one[0]}", one[1]) if isinstance(one, tuple) else f"{when}:{one}" for one in to
    ]


def vehicles(incomplete: str) -> list[Offer]:
    """The shipped vehicles, and files of this folder."""
    return [*shipped_names("vehicle"), *_files(incomplete, _YAML)]


def winds(incomplete: str) -> list[Offer]:
    """The shipped scenarios, the fan of each trajectory, and files of this folder."""
    return [("fan", "that of the trajectory"), *_shipped("scenario", incomplete)]


def faults(incomplete: str) -> list[Offer]:
    """The shipped faults, and files of this folder."""
    return _shipped("fault", incomplete)


def campaigns(incomplete: str) -> list[Offer]:
    """The shipped campaigns, files of this folder, and campaigns that were flown."""
    return [*_shipped("campaign", incomplete), *campaign_folders()]


def missions(incomplete: str) -> list[Offer]:
    """YAML files of this folder."""
    return list(_files(incomplete, _YAML))


def sensors(incomplete: str) -> list[Offer]:
    """The simulator's sensor profiles, and files of this folder."""
    return [*SENSORS.items(), *_files(incomplete, _YAML)]


def logs() -> list[Offer]:
    """Folders of flights in flights/ and here, newest first."""
    return list(_folders_with("flight.mcap", ("flights", ".")))


def campaign_folders() -> list[Offer]:
    """Folders of campaigns in campaigns/ and here, newest first."""
    return list(_folders_with("campaign.json", ("campaigns", ".")))


def reported() -> list[Offer]:
    """Folders that there is something to report on, campaigns first."""
    return [*campaign_folders(), *logs()]


def fault_rows() -> list[Offer]:
    """Names of the rows of the shipped table of faults."""
    text = (configs_folder() / "fault-table.yaml").read_text(encoding="utf-8")
    return list(re.findall(r"^  - name: ([a-z0-9-]+)$", text, re.MULTILINE))


def running_flights() -> list[Offer]:
    """Process ids of flights that run under this user."""
    from companion.flight.command_socket import socket_folder

    try:
        return sorted(path.stem for path in socket_folder().glob("*.sock"))
    except OSError:
        return []


def one_of(values: Iterable[str] | dict[str, str]) -> Complete:
    """Completes one of a few words, with what they are where that is known."""
    offers: list[Offer] = [
        (name, said) if said else name
        for name, said in (
            values.items() if isinstance(values, dict) else ((name, "") for name in values)
        )
    ]
    return lambda: offers


def schema_kinds() -> list[Offer]:
    """Kinds of files that there is a JSON Schema of."""
    return sorted(path.stem for path in schema_path("mission").parent.glob("*.json"))


def settings(incomplete: str) -> list[Offer]:
    """Keys for ``--set``: of the mission, and after controller. and vehicle. those of their files.

    A key that takes one of a few words goes on with them after the ``=``.
    """
    key, equals, _ = incomplete.partition("=")
    kind = key.partition(".")[0]
    kinds = (kind,) if kind in ("controller", "vehicle") else ("mission",)
    found: list[Offer] = ["controller.", "vehicle."] if not equals else []
    for one in kinds:
        prefix = "" if one == "mission" else f"{one}."
        for name, said, choices in _keys_of(one):
            full = f"{prefix}{name}"
            if equals and full == key:
                found += [f"{key}={choice}" for choice in choices]
            elif not equals:
                found.append((f"{full}=", said))
    return found


def _value(offer: Offer) -> str:
    return offer if isinstance(offer, str) else offer[0]


def _shipped(kind: str, incomplete: str) -> list[Offer]:
    return [*shipped_names(kind), *_files(incomplete, _YAML)]


def _files(incomplete: str, suffixes: tuple[str, ...]) -> Iterable[str]:
    """Files of such a kind in the folder that is typed so far; nothing where it can't be read."""
    folder, slash, _ = incomplete.rpartition("/")
    try:
        names = sorted(path.name for path in Path(f"{folder}{slash}" or ".").iterdir())
    except OSError:
        return []
    wanted = [name for name in names if name.endswith(suffixes) and not name.startswith(".")]
    return [f"{folder}{slash}{name}" for name in wanted[:_MOST_FILES]]


def _folders_with(name: str, places: tuple[str, ...]) -> Iterable[str]:
    found = [path.parent for place in places for path in Path(place).glob(f"*/{name}")]
    found.sort(key=lambda path: path.name, reverse=True)
    return [str(path) for path in found[:_MOST_FILES]]


def _is_certifiable(folder: Path) -> bool:
    path = next(iter(sorted(folder.glob("*.yaml"))), None)
    return path is not None and any(
        line.startswith(CERTIFIED_BY) for line in path.read_text(encoding="utf-8").splitlines()
    )


def _keys_of(kind: str) -> Iterable[tuple[str, str, list[str]]]:
    """Dotted keys of a kind of file with what they are, and their choices, by its JSON Schema."""
    try:
        schema = json.loads(schema_path(kind).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return
    yield from _keys_below(schema, schema.get("$defs", {}), "")


def _keys_below(
    section: dict[str, Any], sections: dict[str, Any], prefix: str
) -> Iterable[tuple[str, str, list[str]]]:
    for name, value in section.get("properties", {}).items():
        kinds = [value, *value.get("anyOf", [])]
        inner = next((one["$ref"].rpartition("/")[2] for one in kinds if "$ref" in one), None)
        if inner is not None:
            yield from _keys_below(sections[inner], sections, f"{prefix}{name}.")
            continue
        choices = [str(word) for one in kinds for word in one.get("enum", [])]
        yield f"{prefix}{name}", value.get("description", ""), choices
