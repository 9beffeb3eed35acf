"""Flying the simulated vehicle in lockstep, with one call."""

from collections.abc import Mapping
from operator import index
from pathlib import Path
from typing import Literal, SupportsIndex

from companion.api.carry_out import carry_out
from companion.api.errors import InputError
from companion.api.flight import Flight
from companion.api.order import call_of, make_order, texts_of
from companion.api.own import Wind, name_of, sound_controller, sound_trajectory
from companion.config.resolve import load_flight
from companion.config.yaml_source import ConfigError
from companion.control.own_controller import Controller
from companion.flight.errors import ShimRefusedError
from companion.link.link import LinkError
from companion.recording.flight_log import FlightLogError
from companion.trajectories.from_file import TrajectoryFileError
from companion.trajectories.trajectory import Trajectory

_ROBUST = "mpc-l1"
"""Whose thrust loop and yaw law a controller of one's own flies with, if nothing else is named."""


def fly(
    trajectory: int | str | Path | Trajectory | None = None,
    controller: str | Path | Controller | None = None,
    *,
    vehicle: str | Path | None = None,
    plant: str | Path | None = None,
    wind: str | Path | Wind | None = None,
    seed: int | None = None,
    autopilot: Literal["px4", "ardupilot"] | None = None,
    setpoint: Literal["attitude", "rates"] | None = None,
    sensors: str | Path | None = None,
    faults: str | Path | None = None,
    mission: str | Path | None = None,
    settings: Mapping[str, object] | None = None,
    fallback: str | Path | None = None,
    whole: bool = False,
    folder: str | Path | None = None,
) -> Flight:
    """Fly the simulated vehicle in lockstep: simulated time, as fast as the processor allows.

    The same code flies as in `companion fly --lockstep`, over the same MAVLink bytes; the same
    arguments give the same flight, bit for bit.  It never connects to a real vehicle.

    Args:
        trajectory: 1 … 5, a CSV or YAML file, or a trajectory of one's own; 4 by default.
        controller: its name, its YAML file, or a controller of one's own; "mpc-l1" by default.
        vehicle: what the companion takes the vehicle for: a name or a YAML file; "bebop2" by
            default.
        plant: what the vehicle is: a plant file of the simulator, in place of the one that has
            the vehicle's name.
        wind: a scenario by name or YAML file, or a wind of one's own; "calm" by default.
        seed: of all noise, and of what makes this very vehicle differ from its type; 0 by default.
        autopilot: which one is simulated; "px4" by default.
        setpoint: attitudes, or body rates by the companion's own attitude loop; attitudes by
            default.
        sensors: a sensor profile by name or YAML file, in place of the vehicle's own.
        faults: what goes wrong on purpose, by name or YAML file.
        mission: a mission's YAML file, over which the arguments above win.
        settings: dotted keys of mission, vehicle and controller with their values, as `--set` of
            the command takes them: ``{"controller.mpc.horizon": 40}``.
        fallback: of a controller of one's own: which one takes over when it fails, or when the
            monitor says so; by default none, and a failure ends the flight.
        whole: from the ground to the ground; by default the flight begins in the air at the
            trajectory's first point and ends when tracking is over.
        folder: where logs, `result.json`, `report.html` and the picture go; by default nothing is
            written.

    Raises:
        InputError: it can't be flown as asked: nothing was.
        ControllerError: a controller of one's own raised an exception and had no fallback.
        KeyboardInterrupt: Ctrl-C; the simulated vehicle has landed.  SIGTERM and SIGHUP, too, land
            it first, and then do what they did before: by default they end the program.
        Exception: whatever a wind of one's own raises.
    """
    call = call_of(dict(locals()))
    if seed is not None and not isinstance(seed, SupportsIndex):
        raise InputError(f"seed {seed!r} is no whole number.")
    chosen: dict[str, object] = {
        "vehicle": vehicle,
        "plant": plant,
        "seed": None if seed is None else index(seed),
        "autopilot": autopilot,
        "setpoint": setpoint,
        "sensors": sensors,
        "faults": faults,
    }
    own_trajectory: Trajectory | None = None
    if isinstance(trajectory, SupportsIndex):  # numpy's integers, too
        chosen["trajectory"] = index(trajectory)
    elif trajectory is None or isinstance(trajectory, str | Path):
        chosen["trajectory"] = trajectory
    else:
        own_trajectory = sound_trajectory(trajectory)
        chosen["trajectory"] = name_of(own_trajectory)
    own_controller: Controller | None = None
    if controller is None or isinstance(controller, str | Path):
        chosen["controller"] = controller
        if fallback is not None:
            raise InputError(
                "`fallback` belongs to a controller of one's own; a configured one names its own "
                'in its file. Leave it out, or give settings={"controller.fallback": …}.'
            )
    else:
        own_controller = sound_controller(controller)
        chosen["controller"] = _ROBUST if fallback is None else fallback
    own_wind: Wind | None = None
    if wind is None or isinstance(wind, str | Path):
        chosen["wind"] = wind
    elif callable(wind):
        own_wind = wind
        chosen["wind"] = "calm"
    else:
        raise InputError(f"{wind!r} is no wind. Give a name, a file, or a function (time, place).")
    overrides = {
        key: str(value) if isinstance(value, Path) else value
        for key, value in chosen.items()
        if value is not None
    }
    try:
        config = load_flight(
            None if mission is None else Path(mission), overrides, texts_of(settings or {})
        )
        order = make_order(config, own_trajectory, own_controller, fallback, own_wind, whole=whole)
        return carry_out(order, None if folder is None else Path(folder), call)
    except (ConfigError, TrajectoryFileError, LinkError, ShimRefusedError, FlightLogError) as error:
        raise InputError(str(error)) from error
