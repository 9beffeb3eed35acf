"""Vehicles that are not the one a controller was made for: what is changed, and what is borne."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from companion.config.yaml_source import ConfigError
from companion.experiments.attitude_lag import attitude_lag, slower_attitude
from companion.experiments.perturbed_plant import Change, delayed, scaled, write_plant

NOMINAL = "nominal"
_ALL = "all"
_MILD, _HARD = 2.0, 4.0


@dataclass(frozen=True, slots=True)
class Perturbation:
    """One way in which the flown vehicle, or its link, differs."""

    name: str
    says: str
    """For a person."""
    changes: tuple[Change, ...] = ()
    """Of the plant file."""
    faults: str | None = None
    """What the link does, as a task has it."""
    bearable: float = _MILD
    """How many times its nominal error a robust controller may have."""


def _drag(by: float) -> tuple[Change, ...]:
    names = ("linear_n_s_m", "quadratic_n_s2_m2")
    return tuple(scaled("drag", name, by=by) for name in names)


def _mass(by: float) -> tuple[Change, ...]:
    return (scaled("mass_kg", by=by),)


def _thrust(by: float) -> tuple[Change, ...]:
    return (scaled("propulsion", "max_thrust_n", by=by),)


PERTURBATIONS = {
    perturbation.name: perturbation
    for perturbation in (
        Perturbation(NOMINAL, "the vehicle as it is", bearable=1.0),
        Perturbation("lag+25", "attitude lag + 25 %", (attitude_lag(1.25),)),
        Perturbation("lag-25", "attitude lag − 25 %", (attitude_lag(0.75),)),
        Perturbation("slow+25", "attitude 25 % slower", (slower_attitude(1.25),)),
        Perturbation("mass+20", "mass + 20 %", _mass(1.2)),
        Perturbation("mass-20", "mass − 20 %", _mass(0.8)),
        Perturbation("thrust+15", "thrust + 15 %", _thrust(1.15)),
        Perturbation("thrust-15", "thrust − 15 %", _thrust(0.85)),
        Perturbation("dragx2", "drag × 2", _drag(2.0)),
        Perturbation("delay+20ms", "delay + 20 ms", (delayed(0.020),)),
        Perturbation("loss10", "10 % of packets lost", faults="{link: [{loss: 0.1}]}"),
        Perturbation("lag+50", "attitude lag + 50 %", (attitude_lag(1.5),), bearable=_HARD),
        Perturbation("slow+50", "attitude 50 % slower", (slower_attitude(1.5),), bearable=_HARD),
        Perturbation("delay+40ms", "delay + 40 ms", (delayed(0.040),), bearable=_HARD),
        Perturbation(
            "combo",
            "lag + 25 %, + 20 ms, drag × 2",
            (attitude_lag(1.25), delayed(0.020), *_drag(2.0)),
            bearable=_HARD,
        ),
    )
}
"""By name, in the order in which they are told."""


def chosen(names: Sequence[str]) -> tuple[Perturbation, ...]:
    """Perturbations by their names, each once, the nominal vehicle first.

    Args:
        names: of perturbations; "all" stands for every one; several may stand in one text with
            commas between.

    Raises:
        ConfigError: there is no such one; the text lists those that there are.
    """
    asked = [part.strip().replace("×", "x") for name in names for part in name.split(",")]
    for name in asked:
        if name not in PERTURBATIONS and name != _ALL:
            known = ", ".join((_ALL, *PERTURBATIONS))
            raise ConfigError(f"--perturb {name}: no such perturbation. Give one of: {known}.")
    return tuple(
        perturbation
        for name, perturbation in PERTURBATIONS.items()
        if name == NOMINAL or name in asked or _ALL in asked
    )


def perturbed_plant(vehicle: str, perturbation: Perturbation, folder: Path) -> Path | None:
    """Write the plant file of a perturbed vehicle; None if its plant is as shipped.

    Args:
        vehicle: name of the shim's vehicle.
        perturbation: what is changed.
        folder: of the file; it is there.

    Raises:
        ConfigError: the shim has no such vehicle.
        OSError: the file can't be written.
    """
    if not perturbation.changes:
        return None
    path = folder / f"{vehicle}-{perturbation.name}.yaml"
    return write_plant(vehicle, perturbation.changes, path)
