"""Controllers side by side: which flights, and what came of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from companion.config.yaml_source import ConfigError
from companion.experiments.flight_store import Summary
from companion.experiments.flight_task import FlightTask, load_task
from companion.experiments.perturbations import Perturbation, perturbed_plant
from companion.report.compare_results import Cell, Flown, make_cell

_YAML = (".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class Contender:
    """A controller in the comparison."""

    label: str
    controller: str
    """Name, or path of a YAML file."""
    vehicle: str
    """What the companion takes the vehicle for: name, or path of a YAML file."""


@dataclass(frozen=True, slots=True)
class Grid:
    """What is flown: each contender in each wind under each perturbation, on each trajectory."""

    contenders: tuple[Contender, ...]
    winds: tuple[str, ...]
    perturbations: tuple[Perturbation, ...]
    """The nominal vehicle among them."""
    trajectories: tuple[int | str, ...]
    seeds: tuple[int, ...]
    sensors: str | None = None
    settings: tuple[tuple[str, str], ...] = ()
    """Dotted keys and YAML texts for every flight."""
    whole: bool = False
    """From the ground to the ground, in place of the trajectory alone."""


Place = tuple[str, str, str]
"""Label, wind and perturbation of a cell."""


def contenders(texts: Sequence[str], vehicle: str) -> tuple[Contender, ...]:
    """Controllers as they are given on the command line: ``[LABEL=]CONTROLLER[@VEHICLE]``.

    Args:
        texts: one for each.
        vehicle: of those that name none.

    Raises:
        ConfigError: there is none, or two are the same.
    """
    if not texts:
        raise ConfigError("no controller is given. Name at least one.")
    found: list[Contender] = []
    for text in texts:
        label, _, rest = text.rpartition("=")
        controller, _, own = rest.partition("@")
        if not controller:
            raise ConfigError(f"{text}: no controller is named. Give [LABEL=]NAME|FILE[@VEHICLE].")
        found.append(Contender(label or _short(controller), controller, own or vehicle))
    short = [contender.label for contender in found]
    told = tuple(
        contender
        if "=" in text or short.count(contender.label) == 1
        else Contender(text, contender.controller, contender.vehicle)
        for contender, text in zip(found, texts, strict=True)
    )
    if len({contender.label for contender in told}) < len(told):
        raise ConfigError(
            "a controller, or a label, is given twice. Leave one out, or label it: B=NAME."
        )
    return told


def _short(controller: str) -> str:
    return Path(controller).stem if controller.endswith(_YAML) else controller


def plan(grid: Grid, plants: Path) -> dict[Place, list[FlightTask]]:
    """The flights of each cell.

    Args:
        grid: what is flown.
        plants: folder for the plant files of perturbed vehicles.

    Raises:
        ConfigError: a controller, vehicle or wind can't be used, or the vehicles are not one.
        OSError: a plant file can't be written.
    """
    flown = flown_vehicle(grid)
    paths = {p.name: perturbed_plant(flown, p, plants) for p in grid.perturbations}
    return {
        (contender.label, wind, p.name): [
            FlightTask(
                contender.controller,
                trajectory,
                wind,
                seed,
                contender.vehicle,
                settings=grid.settings,
                sensors=grid.sensors,
                airborne=not grid.whole,
                shim_vehicle=None if paths[p.name] is None else str(paths[p.name]),
                faults=p.faults,
            )
            for trajectory in grid.trajectories
            for seed in grid.seeds
        ]
        for wind in grid.winds
        for p in grid.perturbations
        for contender in grid.contenders
    }


def flown_vehicle(grid: Grid) -> str:
    """Name of the shim's vehicle that all fly.

    Raises:
        ConfigError: a controller or vehicle can't be used, or the vehicles are not one.
    """
    names = {
        contender.label: load_task(
            FlightTask(
                contender.controller,
                grid.trajectories[0],
                grid.winds[0],
                vehicle=contender.vehicle,
                settings=grid.settings,
            )
        ).config.vehicle.name
        for contender in grid.contenders
    }
    if len(set(names.values())) > 1:
        told = ", ".join(f"{label} flies {name}" for label, name in names.items())
        raise ConfigError(f"the controllers fly different vehicles: {told}. Compare on one.")
    return next(iter(names.values()))


def evaluate(
    planned: Mapping[Place, Sequence[FlightTask]], summaries: Mapping[str, Summary], against: str
) -> tuple[Cell, ...]:
    """The cells' figures.

    Args:
        planned: the flights of each cell.
        summaries: their figures by key.
        against: "truth" or "reported".
    """
    by_task = summaries_by_task(planned, summaries)
    return tuple(
        make_cell(*place, [_flown(by_task[task], against) for task in tasks])
        for place, tasks in planned.items()
    )


def summaries_by_task(
    planned: Mapping[Place, Sequence[FlightTask]], summaries: Mapping[str, Summary]
) -> dict[FlightTask, Summary]:
    """Figures of each flight; contenders whose files have the same content share theirs.

    Args:
        planned: the flights of each cell.
        summaries: their figures by key.
    """
    found = {summary.task: summary for summary in summaries.values()}
    tasks = {task for of_cell in planned.values() for task in of_cell}
    return found | {task: summaries[task.key] for task in tasks.difference(found)}


def _flown(summary: Summary, against: str) -> Flown:
    true = against == "truth"
    return Flown(
        _short_trajectory(summary.task.trajectory),
        summary.task.seed,
        summary.outcome,
        summary.note,
        summary.mean_error_m if true else summary.reported_mean_error_m,
        summary.tilt_slew_rms_g_s,
        summary.peak_height_error_m if true else summary.reported_peak_height_error_m,
    )


def _short_trajectory(trajectory: int | str) -> str:
    return str(trajectory) if isinstance(trajectory, int) else Path(trajectory).stem
