"""The targets by name; what one needs is imported only for it."""

from collections.abc import Callable
from pathlib import Path

from tools.fuzz.target import Target

_ROOT = Path(__file__).resolve().parents[2]
_CAPTURES = _ROOT / "tests" / "data" / "captures"


def _companion() -> Target:
    from tools.fuzz.companion_mavlink import CompanionMavlink

    return CompanionMavlink(_CAPTURES)


def _shim() -> Target:
    from tools.fuzz.shim_mavlink import ShimMavlink

    return ShimMavlink(_CAPTURES)


def _yaml() -> Target:
    from tools.fuzz.yaml_files import YamlFiles

    return YamlFiles(_ROOT)


def _trajectory() -> Target:
    from tools.fuzz.trajectory_files import TrajectoryFiles

    return TrajectoryFiles(_ROOT / "configs")


def _logs() -> Target:
    from tools.fuzz.log_files import LogFiles

    return LogFiles()


TARGETS: dict[str, Callable[[], Target]] = {
    "companion-mavlink": _companion,
    "shim-mavlink": _shim,
    "yaml": _yaml,
    "trajectory": _trajectory,
    "logs": _logs,
}

STRETCH = {
    "companion-mavlink": 20_000,
    "shim-mavlink": 48_000,
    "yaml": 5_000,
    "trajectory": 5_000,
    "logs": 1_000,
}
"""Packets or documents of one task: some seconds.  With the seed it says which inputs are run."""
