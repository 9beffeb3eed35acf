"""What a vehicle carries, as a function of time: attached or released at set moments."""

from collections.abc import Sequence
from math import ceil

from sitl_shim.plant.vehicle import VehicleModel
from sitl_shim.wind import Load

LEAST_MASS_SHARE = 0.1
"""Of the vehicle's own mass must stay: inertia and drag are its own, and mean nothing for less."""


class Payload:
    """The loads of a flight, one after another.

    Each is a point mass in the centre of mass: it changes neither the inertia nor any place.

    Args:
        loads: by rising time.
        vehicle: what carries them.
        step_s: of the plant.
    """

    __slots__ = ("_loads", "_step_s", "_vehicle", "next_step")

    def __init__(self, loads: Sequence[Load], vehicle: VehicleModel, step_s: float) -> None:
        self._loads = list(loads)
        self._vehicle = vehicle
        self._step_s = step_s
        self.next_step = -1
        """The step at which the vehicle changes next; -1: never again."""
        self._look_ahead()

    def take(self) -> VehicleModel:
        """The vehicle from `next_step` on: of another mass, with inertia and drag as before."""
        load = self._loads.pop(0)
        self._look_ahead()
        mass_kg = self._vehicle.mass_kg + load.mass_kg
        return self._vehicle.model_copy(update={"mass_kg": mass_kg})

    def _look_ahead(self) -> None:
        if not self._loads:
            self.next_step = -1
            return
        # A time on the grid is that step, whatever rounding makes of the quotient.
        self.next_step = max(0, ceil(self._loads[0].at_s / self._step_s - 1e-6))
