"""What the batched study flies, and what it refuses because it has no model of it."""

import hashlib
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from companion.config.resolve import FlightConfig
from companion.config.yaml_source import ConfigError
from companion.control.frameworks import Stack
from companion.control.qp import daqp_solver
from companion.control.qp.port import QpSolverFactory
from companion.control.qp.solvers import SolverName, solver_factory
from companion.experiments.flight_task import FlightTask, code_digest, load_task
from companion.experiments.perturbed_plant import plant_text
from companion.experiments.shim_files import shim_folder
from companion.flight.assemble import infeasibilities, make_paper_stack, make_trajectory
from companion.flight.setpoints.placement import PlacedTrajectory, place
from companion.trajectories.trajectory import Trajectory

_DIGEST_LETTERS = 12
_SENSORS = "mocap"
_WINDS = ("steady", "dryden", "jet")
_IN_SCENARIO = {"name", "winds"}
_FLIGHTS = "or fly it one by one (engine: flights)"
_FACTORS_WITHIN = (0.1, 10.0)
_LONGEST_DELAY_S = 1.0


@dataclass(frozen=True, slots=True)
class PlantFactors:
    """How a vehicle differs from the one in its plant file."""

    mass: float = 1.0
    thrust: float = 1.0
    """Factor on what the rotors push and turn."""
    attitude_lag: float = 1.0
    """As of `companion.experiments.attitude_lag.attitude_lag`: the lag, at a fixed rate loop."""
    delay_s: float = 0.0
    """Transport delay beside the vehicle's own."""
    drag: float = 1.0


@dataclass(frozen=True, slots=True)
class BatchTask:
    """One vehicle of a batch."""

    flight: FlightTask
    """As it would be flown by itself, with the plant as shipped (`shim_vehicle` None)."""
    plant: tuple[tuple[str, float], ...] = ()
    """Names as a campaign has them (``plant.mass``) with their values."""

    @property
    def factors(self) -> PlantFactors:
        """The plant's parameters.

        Raises:
            ConfigError: one that there is not, or a value that is no vehicle.
        """
        known = {f"plant.{field.name}": field.name for field in fields(PlantFactors)}
        found: dict[str, float] = {}
        for name, value in self.plant:
            if name not in known:
                raise ConfigError(
                    f"{name}: the batched study knows {', '.join(known)}. Remove it, {_FLIGHTS}."
                )
            low, high = _FACTORS_WITHIN
            if name == "plant.delay_s":
                low, high = 0.0, _LONGEST_DELAY_S
            elif name == "plant.drag":
                low = 0.0
            if not low <= value <= high:
                raise ConfigError(f"{name}: {value:g} is no vehicle. Give {low:g} … {high:g}.")
            found[known[name]] = float(value)
        return PlantFactors(**found)

    @property
    def key(self) -> str:
        """Of the result: of the task and of the code; files by their names, not their content."""
        text = f"{code_digest()}{_own_digest()}{self!r}"
        return f"batched-{hashlib.sha256(text.encode()).hexdigest()[:_DIGEST_LETTERS]}"


@dataclass(frozen=True, slots=True)
class Laws:
    """What flies all vehicles of a group."""

    config: FlightConfig
    stack: Stack
    make_solver: QpSolverFactory
    plant: dict[str, Any]
    """The plant file, as shipped."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A task with its files read."""

    task: BatchTask
    factors: PlantFactors
    trajectory: Trajectory
    winds: tuple[dict[str, Any], ...]
    """Of the scenario's file."""
    problems: tuple[str, ...]
    """Why the flight is refused; empty: it is not."""


Groups = list[tuple[Laws, list[tuple[int, Vehicle]]]]
"""Laws with the vehicles that they fly, and each one's place among the tasks."""


def read_tasks(tasks: Sequence[BatchTask]) -> Groups:
    """Read what is flown, each file once, and put together what the same laws fly.

    Raises:
        ConfigError: something can't be used, or is not modelled here; the text names the key and
            the remedy.
    """
    laws: dict[FlightTask, Laws] = {}
    parts: dict[FlightTask, Vehicle] = {}
    groups: dict[FlightTask, list[tuple[int, Vehicle]]] = {}
    for place_, task in enumerate(tasks):
        kind = replace(task.flight, seed=0)
        group = replace(kind, trajectory=1, wind="calm")
        if kind not in parts:
            config = _checked(task.flight)
            if group not in laws:
                laws[group] = _laws(config)
            parts[kind] = _vehicle(task, config, load_task(task.flight).shim.scenario)
        vehicle = replace(parts[kind], task=task, factors=task.factors)
        groups.setdefault(group, []).append((place_, vehicle))
    return [(laws[group], vehicles) for group, vehicles in groups.items()]


def check_batch(tasks: Sequence[BatchTask]) -> None:
    """See that all can be flown; raises as `read_tasks`."""
    read_tasks(tasks)


def _checked(flight: FlightTask) -> FlightConfig:
    for key, given in (("faults", flight.faults), ("sensors", flight.sensors)):
        if given is not None:
            raise _refused(key, str(given), "Leave it out")
    if flight.shim_vehicle is not None:
        raise _refused("shim_vehicle", flight.shim_vehicle, "Give plant parameters (plant.mass …)")
    if not flight.airborne:
        raise _refused("flights", "whole", "Say flights: airborne")
    config = load_task(flight).config
    mission = config.mission
    if config.controller.plus is not None:
        raise _refused("controller", flight.controller, "Take mpc-l1, pid-l1, lqr-l1 or l1")
    if mission.autopilot == "ardupilot":
        raise _refused("autopilot", mission.autopilot, "Take px4")
    if mission.setpoint == "rates":
        raise _refused("setpoint", "rates", "Leave it out")
    if mission.sensors is not None or mission.faults is not None or mission.mocap is not None:
        raise _refused("sensors, faults or mocap", "a mission's", "Leave them out")
    if mission.switch:
        raise _refused("switch", "hand-overs in flight", "Leave it out")
    if config.vehicle.dynamics is None:
        raise _refused("vehicle", flight.vehicle, "Give `dynamics` in its file")
    return config


def _refused(key: str, given: str, remedy: str) -> ConfigError:
    return ConfigError(
        f"{key}: {given}: the batched study does not model it. {remedy}, {_FLIGHTS}."
    )


def _laws(config: FlightConfig) -> Laws:
    plant = yaml.safe_load(plant_text(config.vehicle.name, ()))
    if plant["sensor_profile"] != _SENSORS:
        raise _refused(
            "vehicle", f"{config.vehicle.name} with its estimator", "Take bebop2 or x500"
        )
    # The same optimum several times as quickly, where it is there.
    name: SolverName = "daqp" if daqp_solver.installed() else "osqp"
    solver = solver_factory(name)
    stack = make_paper_stack(config.controller, config.vehicle, config.mission, solver)
    return Laws(config, stack, solver, plant)


def _vehicle(task: BatchTask, config: FlightConfig, scenario: Path) -> Vehicle:
    said = yaml.safe_load(scenario.read_text(encoding="utf-8"))
    winds = tuple(said.get("winds") or ())
    kinds = [wind["kind"] for wind in winds]
    others = {kind for kind in kinds if kind not in _WINDS}
    others |= {name for name, value in said.items() if name not in _IN_SCENARIO and value}
    others |= {f"a second {kind}" for kind in ("dryden", "jet") if kinds.count(kind) > 1}
    if others:
        raise _refused("wind", f"{task.flight.wind} ({_list(others)})", "Take calm, fan or gusts")
    trajectory = make_trajectory(config.mission)
    problems = infeasibilities(trajectory, config.mission, config.vehicle)
    placed = PlacedTrajectory(trajectory, place(config.mission.origin, None, 0.0))
    return Vehicle(task, task.factors, placed, winds, tuple(problems))


def _list(names: Iterable[str]) -> str:
    return ", ".join(sorted(names))


def sensor_noise() -> tuple[list[float], list[float], float]:
    """Standard deviations of position (3), velocity (3) and tilt, rad, of motion capture.

    Raises:
        ConfigError: the shim's profile can't be read.
    """
    path = shim_folder() / "sensors" / "profiles" / f"{_SENSORS}.yaml"
    said = yaml.safe_load(path.read_text(encoding="utf-8"))
    tilt = math.radians(said["attitude"]["noise_deg"][0])
    return said["position_noise_m"], said["velocity_noise_m_s"], tilt


@cache
def _own_digest() -> str:
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
