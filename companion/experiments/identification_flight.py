"""An identification flight: where it may fly; one in lockstep, with nothing written to a file."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from companion.config.models import GeofenceConfig, MissionConfig
from companion.config.resolve import FlightConfig, configs_folder, load_flight
from companion.config.yaml_source import ConfigError
from companion.flight.conduct import Outcome
from companion.flight.embedded_shim import embedded_shim
from companion.flight.experiment import EXPERIMENT, THRUST_REPORT, Experiment
from companion.flight.observer import Observer, SilentObserver
from companion.flight.records import CONTROL
from companion.flight.shim_process import ShimOptions
from companion.frames import Vector3
from companion.identification.excitation import (
    HIGHEST_M,
    SMALLEST_BOX_M,
    Box,
    box_about,
    plan_program,
)
from companion.identification.from_records import recording_from_records
from companion.identification.recording import Recording
from companion.lockstep import fly_in_lockstep
from companion.trajectories.rest import Rest

if TYPE_CHECKING:
    from companion.recording.flight_log import FlightLog

BOX_M = 2.5
"""Half the width of the box, by default."""
HEIGHT_M = 2.5
"""Of the hover point above the ground, by default."""
NAME = "identify"
"""What stands for the trajectory and the controller of such a flight."""
_FOLDER = "identify"
_FENCE_LOW_M = 0.2
_ROOM_ABOVE_M = 2.0
"""Between the box and the fence: an autopilot may take off to a height of its own."""
_HOVER_S = 0.5
_ROUNDING_M = 1e-9
_STEPS_1_M = 10
"""A box or a height that is proposed is a multiple of this part of a metre."""


@dataclass(frozen=True, slots=True)
class IdentificationPlan:
    """What `conduct` is given for an identification flight."""

    config: FlightConfig
    trajectory: Rest
    experiment: Experiment


def load_identification(
    mission_file: Path | None,
    overrides: Mapping[str, object],
    settings: Mapping[str, str],
    *,
    name: str | None = None,
) -> FlightConfig:
    """Mission, vehicle and hold; over a link to a vehicle that is not named, an unknown one.

    Args:
        mission_file: YAML of a mission; None for the defaults.
        overrides: keys of the mission given as options.
        settings: dotted keys, as of any flight; of the controller they change the hold.
        name: what a vehicle over a link is called in place of its file's name; the embedded shim
            knows its vehicles by the names that they have.

    Raises:
        ConfigError: whatever is wrong, with file, line, key and remedy.
    """
    folder = configs_folder() / _FOLDER
    overrides = {**overrides, "controller": str(folder / "hold.yaml")}
    config = load_flight(mission_file, overrides, settings)
    mission = config.mission
    if mission.connect is not None and "vehicle" not in mission.model_fields_set:
        unknown = {**overrides, "vehicle": str(folder / "unknown.yaml")}
        config = load_flight(mission_file, unknown, settings)
    if name is not None and mission.connect is not None:
        config = replace(config, vehicle=config.vehicle.model_copy(update={"name": name}))
    return config


def plan_identification(
    config: FlightConfig, *, box_m: float = BOX_M, height_m: float = HEIGHT_M
) -> IdentificationPlan:
    """The flight that identifies a vehicle.

    Args:
        config: link, vehicle, autopilot, seed and so on; where it flies is set here, within the
            geofence that the mission states, if it states one.
        box_m: half the width of the box.
        height_m: of the hover point above the ground.

    Raises:
        ConfigError: there is no flying in that box, or at that height, or not within the geofence.
    """
    try:
        box = box_about(box_m, height_m)
    except ValueError as error:
        raise ConfigError(f"--box or --height: {error}.") from error
    program = plan_program(box, config.vehicle.speed_limit_m_s)
    fence = _fence(config.mission, box, height_m)
    here = config.mission.origin.model_copy(
        update={"at": "takeoff", "offset_enu_m": (0.0, 0.0, 0.0), "heading_deg": 0.0}
    )
    mission = config.mission.model_copy(
        update={
            "trajectory": NAME,
            "controller": NAME,
            "setpoint": "attitude",
            "takeoff_height_m": height_m,
            "hover_s": _HOVER_S,
            "geofence": fence,
            "origin": here,
        }
    )
    trajectory = Rest("identification", height_m, program.duration_s)
    return IdentificationPlan(
        replace(config, mission=mission), trajectory, Experiment(program, box)
    )


def _fence(mission: MissionConfig, box: Box, height_m: float) -> GeofenceConfig:
    """The box and a little room above it, within the geofence that the mission states.

    Raises:
        ConfigError: the box reaches out of that geofence.
    """
    half_m = box.horizontal_m
    fence = GeofenceConfig(
        low_m=(-half_m, -half_m, _FENCE_LOW_M),
        high_m=(half_m, half_m, height_m + box.vertical_m + _ROOM_ABOVE_M),
    )
    if "geofence" not in mission.model_fields_set:
        return fence
    stated = mission.geofence
    if mission.origin.at == "local":
        raise ConfigError(
            "origin.at: local: an identification flies about the place of take-off, and where that "
            "is in a geofence about the local frame's origin is not known beforehand. State the "
            "geofence about the place of take-off (--set origin.at=takeoff)."
        )
    (west, south, low), (east, north, high) = stated.low_m, stated.high_m
    room_m = min(-west, -south, east, north)
    if half_m > room_m + _ROUNDING_M:
        fits_m = math.floor(_STEPS_1_M * room_m + _ROUNDING_M) / _STEPS_1_M
        remedy = f"--box {fits_m:g} fits" if fits_m >= SMALLEST_BOX_M else "No box fits"
        raise ConfigError(
            f"--box: ±{half_m:g} m about the place of take-off reaches out of the mission's "
            f"geofence, which leaves ±{max(0.0, room_m):g} m. {remedy}; or state a wider "
            f"geofence (at least ±{SMALLEST_BOX_M:g} m)."
        )
    if not _fits_between(low, high, box, height_m):
        raise ConfigError(
            f"--height: a hover of {height_m:g} m, and ±{box.vertical_m:g} m about it, reaches out "
            f"of the mission's geofence, {low:g} to {high:g} m. "
            f"{_height_that_fits(low, high, half_m, height_m)}; or state a taller geofence."
        )
    return GeofenceConfig(
        low_m=_each(max, fence.low_m, stated.low_m), high_m=_each(min, fence.high_m, stated.high_m)
    )


def _each(pick: Callable[[float, float], float], one: Vector3, other: Vector3) -> Vector3:
    """By the axis, the larger or the smaller one."""
    return pick(one[0], other[0]), pick(one[1], other[1]), pick(one[2], other[2])


def _fits_between(low_m: float, high_m: float, box: Box, height_m: float) -> bool:
    below, above = height_m - box.vertical_m, height_m + box.vertical_m
    return low_m <= below + _ROUNDING_M and above <= high_m + _ROUNDING_M


def _height_that_fits(low_m: float, high_m: float, half_m: float, wanted_m: float) -> str:
    """The height nearest to a wanted one whose box stays between two heights, as a remedy."""
    fitting = []
    for step in range(1, round(HIGHEST_M * _STEPS_1_M) + 1):
        height_m = step / _STEPS_1_M
        try:
            box = box_about(half_m, height_m)
        except ValueError:
            continue
        if _fits_between(low_m, high_m, box, height_m):
            fitting.append(height_m)
    if not fitting:
        return "No height fits"
    return f"--height {min(fitting, key=lambda h: abs(h - wanted_m)):g} fits"


class RecordKeeper:
    """Takes what a `FlightLog` takes; keeps the records that a recording is made of."""

    def __init__(self) -> None:
        self.kept: dict[str, list[Mapping[str, Any]]] = {
            topic: [] for topic in (CONTROL.topic, THRUST_REPORT.topic, EXPERIMENT.topic)
        }
        self.folder = Path()

    def frame_in(self, time_s: float, raw: bytes) -> None:
        """Pass over a received packet."""

    def frame_out(self, time_s: float, raw: bytes) -> None:
        """Pass over a sent packet."""

    def record(self, topic: str, time_s: float, values: Mapping[str, Any]) -> None:
        """Keep a record."""
        kept = self.kept.get(topic)
        if kept is not None:
            kept.append(values)

    def recording(self) -> Recording:
        """What was flown.

        Raises:
            UnidentifiedError: nothing was.
        """
        return recording_from_records(
            self.kept[CONTROL.topic], self.kept[THRUST_REPORT.topic], self.kept[EXPERIMENT.topic]
        )


def fly_identification(
    vehicle: str,
    *,
    autopilot: str = "px4",
    seed: int = 1,
    sensors: str | None = None,
    wind: str = "calm",
    box_m: float = BOX_M,
    airborne: bool = True,
    shim: ShimOptions | None = None,
    observer: Observer | None = None,
) -> tuple[Outcome, RecordKeeper]:
    """Fly an identification flight of a shipped vehicle in lockstep.

    Args:
        vehicle: its name, or a file.
        autopilot: px4 or ardupilot.
        seed: of all noise.
        sensors: a sensor profile of the shim in place of the vehicle's own.
        wind: a scenario, by name or file.
        box_m: half the width of the box.
        airborne: begin in the air, and end there.
        shim: another one than the embedded one of the vehicle.
        observer: told what happens.

    Raises:
        ConfigError: a file can't be used.
        ShimRefusedError: the shim can't simulate it.
    """
    chosen = {"vehicle": vehicle, "autopilot": autopilot, "seed": seed, "wind": wind}
    config = load_identification(None, {**chosen, "sensors": sensors}, {})
    plan = plan_identification(config, box_m=box_m)
    keeper = RecordKeeper()
    outcome = fly_in_lockstep(
        plan.config,
        plan.trajectory,
        cast("FlightLog", keeper),
        observer or SilentObserver(),
        shim or embedded_shim(plan.config),
        airborne=airborne,
        experiment=plan.experiment,
    )
    return outcome, keeper
