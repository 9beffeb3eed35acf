"""What `fly` is asked for, looked at and joined."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from companion.api.errors import InputError
from companion.api.own import WatchedController, Wind, name_of
from companion.config.resolve import FlightConfig
from companion.control.own_controller import Controller
from companion.experiments.shim_files import check_sensors
from companion.flight import assemble
from companion.flight.beginning import check_sharing, key_to_sign_with
from companion.flight.embedded_shim import embedded_shim
from companion.flight.own_parts import OwnController
from companion.flight.shim_process import ShimOptions
from companion.trajectories.trajectory import Trajectory


@dataclass(frozen=True, slots=True)
class Order:
    """What is to be flown, all of it looked at."""

    config: FlightConfig
    trajectory: Trajectory
    own: OwnController | None
    watched: WatchedController | None
    wind: Wind | None
    shim: ShimOptions
    signing_key: bytes | None
    whole: bool
    replayable: bool


def make_order(
    config: FlightConfig,
    trajectory: Trajectory | None,
    controller: Controller | None,
    fallback: str | Path | None,
    wind: Wind | None,
    *,
    whole: bool,
) -> Order:
    """Join configuration and own parts, as `companion fly` looks at its own.

    Raises:
        InputError: the mission is one for a real vehicle, or the trajectory does not fit.
        ConfigError: a file can't be used.
        TrajectoryFileError: the trajectory's can't.
        LinkError: an endpoint of the mission can't be one.
    """
    if config.mission.connect is not None:
        raise InputError(
            "the mission has `connect`: a real vehicle is flown by the command `companion fly`, "
            "not from here. Leave it out."
        )
    replayable = trajectory is None
    trajectory = assemble.make_trajectory(config.mission) if trajectory is None else trajectory
    problems = assemble.infeasibilities(trajectory, config.mission, config.vehicle)
    if problems:
        raise InputError("\n".join(problems))
    check_sharing(config.mission, lockstep=True)
    key = key_to_sign_with(config.mission, None)
    shim = replace(embedded_shim(config), signing_key=key)
    if shim.sensors is not None:
        check_sensors(shim.sensors)
    own = watched = None
    said: dict[str, str] = {}
    others = dict(config.others)
    if controller is not None:
        others[config.mission.controller] = config.controller  # may be asked for by `switch`
        watched = WatchedController(controller)
        said["controller"] = name_of(controller)
        below = None if fallback is None else str(fallback)
        own = OwnController(watched, said["controller"], below)
    if wind is not None:
        said["wind"] = name_of(wind)
    # What is said of the flight: nothing is looked up by these any more.
    config = replace(config, mission=config.mission.model_copy(update=said), others=others)
    return Order(config, trajectory, own, watched, wind, shim, key, whole, replayable)


def texts_of(settings: Mapping[str, object]) -> dict[str, str]:
    """Values as YAML texts; a text is YAML already.

    Raises:
        InputError: one is nothing that YAML has.
    """
    if not isinstance(settings, Mapping):
        raise InputError(f"settings {settings!r} are none. Give {{key: value}}.")
    try:
        return {
            key: value if isinstance(value, str) else json.dumps(value, default=_plain)
            for key, value in settings.items()
        }
    except (TypeError, ValueError) as error:
        raise InputError(f"settings {dict(settings)!r}: {error}.") from error


def _plain(value: object) -> object:
    """One of numpy's numbers, or an array, as Python's."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"{value!r} is nothing that YAML has")


def call_of(arguments: Mapping[str, object]) -> str:
    """The call of `fly` with what was given; parts of one's own by their names."""
    told = [
        f"{key}={value!r}"
        if isinstance(value, str | int | Mapping)
        else f"{key}={str(value)!r}"
        if isinstance(value, Path)
        else f"{key}={name_of(value)}"
        for key, value in arguments.items()
        if value is not None and value is not False
    ]
    return f"companion.api.fly({', '.join(told)})"
