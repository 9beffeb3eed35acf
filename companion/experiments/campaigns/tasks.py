"""From a planned flight to the task that flies it."""

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from companion.config.models import VehicleConfig
from companion.config.resolve import find_config
from companion.config.validation import validate
from companion.config.yaml_source import ConfigError, parse_yaml, read_yaml
from companion.experiments.campaigns.models import Value
from companion.experiments.campaigns.parameters import (
    NAMED,
    NO_FAULTS,
    label,
    plant_changes,
    settings_of_point,
    yaml_text,
)
from companion.experiments.campaigns.plan import Plan, PlannedFlight
from companion.experiments.controller_file import write_whole
from companion.experiments.flight_task import FlightTask
from companion.experiments.perturbed_plant import plant_text

_DIGEST_LETTERS = 12


def task_of(plan: Plan, flight: PlannedFlight, folder: Path) -> FlightTask:
    """A flight as a task; the plant file of a changed vehicle is written.

    Args:
        plan: of the campaign.
        flight: of the plan.
        folder: of plant files.

    Raises:
        ConfigError: its vehicle can't be used.
        OSError: the plant file can't be written.
    """
    task = nominal_task(plan, flight)
    changes = plant_changes(flight.values)
    if not changes:
        return task
    vehicle = _vehicle_name(task.vehicle)
    text = plant_text(vehicle, changes)
    digest = hashlib.sha256(text.encode()).hexdigest()[:_DIGEST_LETTERS]
    path = folder / f"{vehicle}-{digest}.yaml"
    if not path.is_file():
        write_whole(path, text)
    return replace(task, shim_vehicle=str(path))


def nominal_task(plan: Plan, flight: PlannedFlight) -> FlightTask:
    """A flight as a task, with the plant as shipped whatever the point says of it."""
    base, values = plan.config.base, flight.values
    chosen: dict[str, Any] = {name: values.get(name, getattr(base, name)) for name in NAMED}
    return FlightTask(
        controller=chosen["controller"],
        trajectory=_trajectory(chosen["trajectory"]),
        wind=chosen["wind"],
        vehicle=chosen["vehicle"],
        seed=int(str(values.get("seed", base.seed))),
        settings=settings_of_point(base, values),
        sensors=chosen["sensors"],
        faults=_faults(chosen["faults"]),
        airborne=base.flights == "airborne",
    )


def checked_tasks(plan: Plan, folder: Path) -> list[tuple[str, FlightTask]]:
    """The tasks of all flights with their keys, each seen to be one that can be begun.

    Raises:
        ConfigError: one can't be flown; the text names the point and its values.
        OSError: a plant file can't be written.
    """
    tasks: list[tuple[str, FlightTask]] = []
    for flight in plan.flights:
        try:
            task = task_of(plan, flight, folder)
            tasks.append((task.key, task))  # the key needs all files read and checked
        except ConfigError as error:
            line, remedy = _blamed(plan, flight, str(error))
            raise ConfigError(
                f"{plan.path}{line}: point {flight.point} ({described(flight.values)}) can't be "
                f"flown: {error}{remedy}"
            ) from error
    return tasks


def _blamed(plan: Plan, flight: PlannedFlight, said: str) -> tuple[str, str]:
    """The line of the key that a refusal speaks of, as far as it tells, and what to do there."""
    values: dict[str, Any] = {**plan.config.base.settings, **flight.values}
    named = [n for n in values if f"--set {n}:" in said or f"--set {n}=" in said]
    names = named or [n for n, value in flight.values.items() if f"'{label(value)}'" in said]
    if not names:
        return "", ""
    lines = parse_yaml(plan.text, str(plan.path)).lines
    places = [
        (*section, names[0]) for section in (("parameters",), ("each",), ("base", "settings"))
    ]
    line = next((f", line {lines[place]}" for place in places if place in lines), "")
    given = plan.config.parameters.get(names[0])
    broken = given is not None and given.values is None and not given.integer
    is_whole = broken and "valid integer" in said
    return line, " Add integer: true to its range." if is_whole else ""


def described(values: Mapping[str, Value]) -> str:
    """A point's values on one line."""
    return ", ".join(
        f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {label(value)}"
        for name, value in values.items()
    )


def _trajectory(value: Value) -> int | str:
    assert isinstance(value, int | str)
    return value


def _faults(value: Value) -> str | None:
    if value is None or value == NO_FAULTS:
        return None
    return value if isinstance(value, str) else yaml_text(value)


@cache
def _vehicle_name(vehicle: str) -> str:
    """Name of the shim's vehicle that a vehicle's file is about."""
    return validate(VehicleConfig, read_yaml(find_config("vehicle", vehicle))).name
