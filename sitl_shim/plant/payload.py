"""What a vehicle carries."""

from sitl_shim.plant.vehicle import VehicleModel
from sitl_shim.wind import Load

LEAST_MASS_SHARE = 0.1
"""Of the vehicle's own mass must stay: inertia and drag are its own, and mean nothing for less."""


def loaded(vehicle: VehicleModel, load: Load) -> VehicleModel:
    """The vehicle with a load: of another mass, with inertia and drag as before.

    The load is a point mass in the centre of mass: it changes neither the inertia nor any place.
    """
    mass_kg = vehicle.mass_kg + load.mass_on(vehicle.mass_kg)
    return vehicle.model_copy(update={"mass_kg": mass_kg})
