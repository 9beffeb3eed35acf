"""The command line that flies a flight again."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path

_NAMES = {"trajectory": "traj"}
"""Options that are not called as their keys."""
_FIRST = ("trajectory", "controller", "vehicle", "autopilot", "wind", "seed")


def flying_command(
    mission_file: Path | None,
    overrides: Mapping[str, object],
    settings: Sequence[str],
    signing_key_file: Path | None,
    *,
    lockstep: bool,
) -> str:
    """What to type for the same flight; without its folder, so that none is written over.

    Args:
        mission_file: of `--mission`.
        overrides: options by the mission's keys.
        settings: of `--set`, `KEY=VALUE` each.
        signing_key_file: the key's file; the key itself is told nowhere.
        lockstep: in simulated time.
    """
    words = ["companion", "fly"]
    if mission_file is not None:
        words += ["--mission", str(mission_file)]
    order = [key for key in _FIRST if key in overrides]
    order += [key for key in overrides if key not in _FIRST]
    for key in order:
        value = overrides[key]
        for one in value if isinstance(value, list | tuple) else (value,):
            words += [f"--{_NAMES.get(key, key).replace('_', '-')}", str(one)]
    for setting in settings:
        words += ["--set", setting]
    if signing_key_file is not None:
        words += ["--signing-key-file", str(signing_key_file)]
    return shlex.join([*words, *(["--lockstep"] if lockstep else [])])
