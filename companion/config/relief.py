"""The controllers that a flight may be handed over to."""

from collections.abc import Callable
from pathlib import Path

from companion.config.models import ControllerConfig, MissionConfig

NO_FALLBACK = "none"
"""What a controller's file says that has none."""
PLUS: str = "mpc-l1-plus"
"""The framework that has a cautious variant, and a fallback unless its file says otherwise."""
ROBUST = "mpc-l1"
"""What it falls back to if its file names nothing else."""
_SUFFIXES = (".yaml", ".yml")

ReadController = Callable[[str], ControllerConfig]
"""Reads a controller by name or path for the flight's vehicle.

Raises:
    ConfigError: there is none, or it is wrong.
"""


def with_reliefs(
    mission: MissionConfig, controller: ControllerConfig, read: ReadController, *, robust: bool
) -> tuple[ControllerConfig, dict[str, ControllerConfig]]:
    """A controller whose `fallback` is settled, and all that may relieve it.

    Args:
        mission: whose planned hand-overs count.
        controller: that is configured.
        read: reads another one.
        robust: there is a `mpc-l1` for the vehicle.

    Returns:
        The controller; and the others by name: fallbacks by what `fallback` says now, and those of
        hand-overs by what the mission calls them.

    Raises:
        ConfigError: one of them can't be found or read.
    """
    others: dict[str, ControllerConfig] = {}

    def settled(one: ControllerConfig, called: str) -> ControllerConfig:
        name = _fallback_of(one, called, robust=robust)
        if name is not None and name not in others:
            # A fallback has none of its own: what is below it is the autopilot.
            others[name] = read(name).model_copy(update={"fallback": None})
        return one.model_copy(update={"fallback": name})

    configured = settled(controller, mission.controller)
    for name in dict.fromkeys(switch.controller for switch in mission.switch):
        if name is not None and name != mission.controller:
            others[name] = settled(read(name), name)
    return configured, others


def _fallback_of(controller: ControllerConfig, called: str, *, robust: bool) -> str | None:
    """What a controller falls back to: a name, or a path from where one is; None: nothing."""
    name = controller.fallback
    if name is None:
        return ROBUST if robust and controller.framework == PLUS else None
    if name == NO_FALLBACK:
        return None
    if name.endswith(_SUFFIXES) and called.endswith(_SUFFIXES):
        return str(Path(called).parent / name)
    return name


def switch_from(value: object, folder: Path) -> object:
    """A planned hand-over as a mission's file has it; a controller's file in it is beside that."""
    if isinstance(value, str) and value.endswith(_SUFFIXES):
        when, colon, name = value.partition(":")
        return f"{when}{colon}{folder / name}" if colon else value
    if isinstance(value, dict) and str(value.get("to", "")).endswith(_SUFFIXES):
        return {**value, "to": str(folder / value["to"])}
    return value
