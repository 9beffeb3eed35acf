"""What differs between autopilots: one module for each, all of the shape of `AutopilotDialect`.

A new autopilot is a module of its own and one line in `_DIALECTS`.
"""

from companion.mavlink.dialects.ardupilot import ArduPilot
from companion.mavlink.dialects.base import AutopilotDialect
from companion.mavlink.dialects.px4 import Px4

_DIALECTS: tuple[AutopilotDialect, ...] = (Px4(), ArduPilot())


def dialect_names() -> tuple[str, ...]:
    """Names of the autopilots that the companion can fly."""
    return tuple(dialect.name for dialect in _DIALECTS)


def dialect_for(autopilot_id: int) -> AutopilotDialect | None:
    """The dialect of a MAV_AUTOPILOT, as heartbeats carry it; None if the companion knows none."""
    return next((d for d in _DIALECTS if d.autopilot_id == autopilot_id), None)


def dialect_named(name: str) -> AutopilotDialect:
    """The dialect of a name.

    Raises:
        KeyError: there is none; the text lists the names.
    """
    for dialect in _DIALECTS:
        if dialect.name == name:
            return dialect
    raise KeyError(f"no autopilot {name!r}; there are {', '.join(dialect_names())}")
