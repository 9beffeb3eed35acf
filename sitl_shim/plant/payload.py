"""What a vehicle carries."""

from pathlib import Path

from sitl_shim.data_file import DataFileError
from sitl_shim.plant.vehicle import VehicleModel
from sitl_shim.wind import Load, Scenario, scenario_path

_LEAST_MASS_SHARE = 0.1
"""Of the vehicle's own mass must stay: inertia and drag are its own, and mean nothing for less."""


def loaded(vehicle: VehicleModel, load: Load) -> VehicleModel:
    """The vehicle with a load: of another mass, with inertia and drag as before.

    The load is a point mass in the centre of mass: it changes neither the inertia nor any place.
    """
    mass_kg = vehicle.mass_kg + load.mass_on(vehicle.mass_kg)
    return vehicle.model_copy(update={"mass_kg": mass_kg})


def refuse_too_light(scenario: Scenario, vehicle: VehicleModel, name_or_path: str | Path) -> None:
    """Refuse a payload that leaves too little of the vehicle.

    Raises:
        DataFileError: it names the scenario's file and the key.
    """
    least_kg = _LEAST_MASS_SHARE * vehicle.mass_kg
    for index, load in enumerate(scenario.payload):
        total_kg = vehicle.mass_kg + load.mass_on(vehicle.mass_kg)
        if total_kg < least_kg:
            raise DataFileError(
                f"scenario file {scenario_path(name_or_path)}: 'payload.{index}.{load.mass_key}' "
                f"cannot be {getattr(load, load.mass_key):g}: {vehicle.name} with it would weigh "
                f"{total_kg:g} kg, and at least {least_kg:g} kg must stay of its "
                f"{vehicle.mass_kg:g} kg."
            )
