"""The list of parameters that were set for a flight, on disk before the first of them is set.

So what a companion that was killed has left behind can be mended by
``companion check --connect URL --restore FILE``.
"""

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from companion.preflight.finding import ParameterChange

RESTORE_NAME = "restore.json"
_ABOUT = (
    "Parameters that companion has set on an autopilot. `companion check --connect URL --restore "
    "FILE` sets them back; after a flight that could do so itself, this file is gone."
)


class RestoreFileError(Exception):
    """The file cannot be written or read; the text says which, why and the remedy."""


@dataclass(frozen=True, slots=True)
class RestoreList:
    """What was to be set, and on what."""

    autopilot: str
    """Name of its dialect."""
    system_id: int
    changes: tuple[ParameterChange, ...]
    """In the order of setting."""


def write_restore_file(path: Path, wanted: RestoreList, *, replace: bool = False) -> None:
    """Write the list and see it to the disk.

    Args:
        path: where to.
        wanted: the list.
        replace: a file of that name is an earlier list of the same flight.

    Raises:
        RestoreFileError: it cannot be written, or a file of that name is there.
    """
    data = {
        "about": _ABOUT,
        "autopilot": wanted.autopilot,
        "system_id": wanted.system_id,
        "parameters": [
            {"name": c.name, "old": c.old, "new": c.new, "why": c.why} for c in wanted.changes
        ],
    }
    try:
        with path.open("w" if replace else "x", encoding="utf-8") as file:
            json.dump(data, file, indent=2, ensure_ascii=False, allow_nan=False)
            file.write("\n")
            file.flush()
            os.fsync(file.fileno())
    except FileExistsError as error:
        raise RestoreFileError(
            f"{path} is there already: parameters of an earlier flight wait to be restored. Do so "
            f"(companion check --connect URL --restore {path}), or move the file away."
        ) from error
    except OSError as error:
        raise RestoreFileError(
            f"{path} cannot be written ({error.strerror or error}), so no parameter is set. Choose "
            "another folder with --out."
        ) from error


def read_restore_file(path: Path) -> RestoreList:
    """Read a list.

    Raises:
        RestoreFileError: it cannot be read, or is none.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        return RestoreList(
            str(data["autopilot"]),
            int(data["system_id"]),
            tuple(_change(entry) for entry in _entries(data)),
        )
    except OSError as error:
        raise RestoreFileError(
            f"{path} cannot be read: {error.strerror or error}. Check the path."
        ) from error
    except (ValueError, LookupError, TypeError, ArithmeticError, RecursionError) as error:
        raise RestoreFileError(
            f"{path} is no list of parameters to restore ({type(error).__name__}: {error}). Give "
            f"the {RESTORE_NAME} of a flight's folder."
        ) from error


def _entries(data: dict[str, object]) -> Sequence[dict[str, object]]:
    entries = data["parameters"]
    if not isinstance(entries, list):
        raise TypeError("parameters are not a list")
    return entries


def _change(entry: dict[str, object]) -> ParameterChange:
    old, new = float(str(entry["old"])), float(str(entry["new"]))
    if not (math.isfinite(old) and math.isfinite(new)):
        raise ValueError("a value is not finite")
    return ParameterChange(str(entry["name"]), old, new, str(entry.get("why", "")))
