"""Flying the simulated vehicle in lockstep, with one call."""

import asyncio
import json
import math
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeVar, cast

from companion.api.errors import ControllerError, InputError
from companion.api.flight import Flight, figures_of, ticks_of, truth_of
from companion.api.own import (
    WatchedController,
    Wind,
    name_of,
    sound_controller,
    sound_trajectory,
)
from companion.config.resolve import FlightConfig, load_flight
from companion.config.yaml_source import ConfigError
from companion.control.own_controller import Controller
from companion.experiments.memory_log import MemoryLog
from companion.experiments.shim_files import check_sensors
from companion.flight import assemble
from companion.flight.beginning import begin_log, check_sharing, discard_log, key_to_sign_with
from companion.flight.conduct import Outcome
from companion.flight.embedded_shim import embedded_shim
from companion.flight.errors import ShimRefusedError
from companion.flight.inbox import Inbox
from companion.flight.observer import TickView
from companion.flight.own_parts import OwnController
from companion.flight.records import CHANNELS
from companion.flight.shim_process import ShimOptions
from companion.link.link import LinkError
from companion.lockstep import fly_in_lockstep
from companion.recording.flight_log import FlightLogError
from companion.report.aftermath import score_and_draw
from companion.report.flight_data import FlightData, read_flight
from companion.trajectories.from_file import TrajectoryFileError
from companion.trajectories.trajectory import Trajectory

if TYPE_CHECKING:
    from companion.recording.flight_log import FlightLog

_ROBUST = "mpc-l1"
"""Whose thrust loop and yaw law a controller of one's own flies with, if nothing else is named."""
_Result = TypeVar("_Result")


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
        folder: where logs, `result.json` and the picture go; by default nothing is written.

    Raises:
        InputError: it can't be flown as asked: nothing was.
        ControllerError: a controller of one's own raised an exception and had no fallback.
        KeyboardInterrupt: Ctrl-C; the simulated vehicle has landed.
        Exception: whatever a wind of one's own raises.
    """
    chosen: dict[str, object] = {
        "vehicle": vehicle,
        "plant": plant,
        "seed": seed,
        "autopilot": autopilot,
        "setpoint": setpoint,
        "sensors": sensors,
        "faults": faults,
    }
    own_trajectory: Trajectory | None = None
    if trajectory is None or isinstance(trajectory, int | str | Path):
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
            None if mission is None else Path(mission), overrides, _texts(settings or {})
        )
        order = _order(config, own_trajectory, own_controller, fallback, own_wind, whole=whole)
        return _flown(order, None if folder is None else Path(folder))
    except (ConfigError, TrajectoryFileError, LinkError, ShimRefusedError, FlightLogError) as error:
        raise InputError(str(error)) from error


@dataclass(frozen=True, slots=True)
class _Order:
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


def _order(
    config: FlightConfig,
    trajectory: Trajectory | None,
    controller: Controller | None,
    fallback: str | Path | None,
    wind: Wind | None,
    *,
    whole: bool,
) -> _Order:
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
    return _Order(config, trajectory, own, watched, wind, shim, key, whole, replayable)


def _flown(order: _Order, folder: Path | None) -> Flight:
    """Fly, and make arrays of it."""
    inbox, observer = Inbox(), _Listener()
    log = MemoryLog() if folder is None else _log_in(folder)
    started = time.perf_counter()

    def fly_now() -> Outcome:
        return fly_in_lockstep(
            order.config,
            order.trajectory,
            cast("FlightLog", log),  # all that a flight asks of one is what a MemoryLog has
            observer,
            order.shim,
            inbox=inbox,
            airborne=not order.whole,
            signing_key=order.signing_key,
            own=order.own,
            own_wind=order.wind,
            replayable=order.replayable,
        )

    try:
        outcome = _outside_any_loop(fly_now)
    except BaseException:
        if folder is not None:
            cast("FlightLog", log).close()
            discard_log(folder, folder_too=False)
        raise
    data: FlightData
    if isinstance(log, MemoryLog):
        data = log.data()
    else:
        log.close()
        assert folder is not None
        _, trouble = score_and_draw(order.config, outcome, folder, time.perf_counter() - started)
        data = read_flight(folder)
        for text in (trouble, log.trouble):
            if text is not None:
                observer.message("warning", text)
    if inbox.interrupts:
        raise KeyboardInterrupt
    raised = None if order.watched is None else order.watched.raised
    if raised is not None and order.own is not None and order.own.fallback is None:
        raise ControllerError(
            f"{order.own.name} failed in flight ({type(raised).__name__}: {raised})"
        ) from raised
    return _result(order, outcome, data, tuple(observer.warnings), folder)


def _result(
    order: _Order,
    outcome: Outcome,
    data: FlightData,
    warnings: tuple[str, ...],
    folder: Path | None,
) -> Flight:
    mission, scored_s = order.config.mission, outcome.scored_s
    figures = figures_of(data, scored_s)
    if not outcome.completed:
        lost = math.inf
        figures = replace(
            figures,
            mean_error_m=lost,
            rms_error_m=lost,
            max_error_m=lost,
            reported_mean_error_m=lost,
        )
    began_s = math.nan if scored_s is None else scored_s[0]
    return Flight(
        outcome=outcome.outcome,
        completed=outcome.completed,
        note=outcome.note,
        warnings=warnings,
        trajectory=order.trajectory.name,
        controller=mission.controller,
        vehicle=mission.vehicle,
        wind=mission.wind,
        seed=mission.seed,
        scored_s=scored_s,
        figures=figures,
        ticks=ticks_of(data, began_s),
        truth=truth_of(data, began_s),
        folder=folder,
        data=data,
    )


class _Listener:
    """Keeps what a person would be warned of."""

    looks_at_ticks = False

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def phase(self, name: str, detail: str) -> None:
        """Nobody looks."""

    def tick(self, view: TickView) -> None:
        """Nobody looks."""

    def message(self, severity: str, text: str) -> None:
        """Keep what is more than information."""
        if severity != "info":
            self.warnings.append(text)


def _log_in(folder: Path) -> "FlightLog":
    return begin_log(folder, CHANNELS, lockstep=True)


def _texts(settings: Mapping[str, object]) -> dict[str, str]:
    """Values as YAML texts; a text is YAML already.

    Raises:
        InputError: one is nothing that YAML has.
    """
    try:
        return {
            key: value if isinstance(value, str) else json.dumps(value, default=float)
            for key, value in settings.items()
        }
    except (TypeError, ValueError) as error:
        raise InputError(f"settings {dict(settings)!r}: {error}.") from error


def _outside_any_loop(work: Callable[[], _Result]) -> _Result:
    """Call something that runs an event loop: in a notebook, where one runs, in a thread."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return work()
    with ThreadPoolExecutor(1, thread_name_prefix="flight") as thread:
        return thread.submit(work).result()
