"""Which embedded shim flies a configured mission: vehicle, wind, faults, seed."""

from pathlib import Path

import yaml

from companion.config.models import MissionConfig
from companion.config.resolve import FlightConfig, find_config, shipped_names
from companion.config.yaml_source import ConfigError, read_yaml
from companion.flight.shim_process import ShimOptions
from companion.mocap.parameters import misfits

_BOOT_SCALES = {"ardupilot": 0.1}
"""A real ArduPilot takes 42 s until its estimator has a position: nobody learns from the wait."""
_YAML = (".yaml", ".yml")
_ONE_LINE = 1_000_000
"""Letters: longer than anything that a mission says."""


def embedded_shim(config: FlightConfig) -> ShimOptions:
    """What the embedded shim is told for a flight.

    Raises:
        ConfigError: it has no such vehicle, or the scenario or the faults are not there.
    """
    mission = config.mission
    autopilot = "px4" if mission.autopilot == "auto" else mission.autopilot
    return ShimOptions(
        autopilot=autopilot,
        vehicle=_plant(config),
        scenario=scenario_path(mission),
        seed=mission.seed,
        sensors=mission.sensors,
        boot_scale=_BOOT_SCALES.get(autopilot, 1.0),
        parameters=_parameters(mission, autopilot),
        faults=faults_text(mission),
    )


def _parameters(mission: MissionConfig, autopilot: str) -> dict[str, float]:
    """What differs from the vehicle's parameters: motion capture is for a room without satellites.

    Raises:
        ConfigError: the shim cannot do that.
    """
    if mission.mocap is None:
        return {}
    if autopilot != "px4":
        raise ConfigError(
            "the embedded ArduPilot shim does not fuse poses. Leave motion capture out (--mocap, "
            "`mocap`), or fly PX4 or a real vehicle with it."
        )
    if mission.mocap.system != "udp":
        raise ConfigError(
            f"the embedded shim's cameras speak mocap.system udp, not {mission.mocap.system}. "
            "Set that, or fly a real vehicle with --connect."
        )
    return {misfit.name: misfit.wanted for misfit in misfits("px4", {})}


def _plant(config: FlightConfig) -> str:
    """The shim's vehicle: it has one for each vehicle that is shipped, of the same name.

    Raises:
        ConfigError: it has none of that name, or the mission's plant file is not there.
    """
    plant = config.mission.plant
    if plant is not None:
        path = Path(plant).resolve()
        if not path.is_file() or path.suffix not in _YAML:
            raise ConfigError(
                f"plant: {plant}: no such YAML file. Check the path; a vehicle that the shim has "
                "needs no plant file, its name is enough."
            )
        return str(path)
    name = config.vehicle.name
    known = shipped_names("vehicle")
    if name not in known:
        raise ConfigError(
            f"{config.mission.vehicle}: the embedded shim can't fly the vehicle '{name}'. Set "
            f"`name` in the file to the one that it is like ({', '.join(known)}), give its plant "
            "file (--plant FILE), or the link to a real one with --connect."
        )
    return name


def scenario_path(mission: MissionConfig) -> Path:
    """The scenario's file; the fan stands elsewhere for each of the five trajectories.

    Raises:
        ConfigError: there is none, or it is not YAML.
    """
    name = mission.wind
    if name == "fan":
        if not isinstance(mission.trajectory, int):
            raise ConfigError(
                "--wind fan has its place at one of the trajectories 1 … 5; for a trajectory from "
                "a file give a scenario's YAML file (see configs/scenarios/fan-4.yaml)."
            )
        name = f"fan-{mission.trajectory}"
    path = find_config("scenario", name, also=["fan"]).resolve()
    read_yaml(path)  # what it says is the shim's; that it is YAML is known before anything starts
    return path


def faults_text(mission: MissionConfig) -> str | None:
    """What the shim is told of faults: the file's path, or the faults themselves as YAML.

    Raises:
        ConfigError: there is no such file, or it is not YAML.
    """
    faults = mission.faults
    if isinstance(faults, dict):
        return yaml.safe_dump(faults, default_flow_style=True, sort_keys=False, width=_ONE_LINE)
    if faults is None or faults.lstrip().startswith("{"):
        return faults
    path = find_config("fault", faults).resolve()
    read_yaml(path)  # what it says is the shim's, as of a scenario
    return str(path)
