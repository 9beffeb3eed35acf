import pytest

from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.vehicle import load_vehicle
from sitl_shim.wind.field import CALM


def without_spread(vehicle, **changes):
    """The vehicle with nominal thrust, a battery that does not sag, and changes."""
    spread = vehicle.spread.model_copy(update={"thrust_fraction": 0.0})
    battery = vehicle.battery.model_copy(update={"voltage_exponent": 0.0})
    return vehicle.model_copy(update={"spread": spread, "battery": battery, **changes})


@pytest.fixture(params=["bebop2", "x500", "sih_quadx"])
def vehicle(request):
    return without_spread(load_vehicle(request.param))


@pytest.fixture
def ideal():
    return without_spread


@pytest.fixture
def airborne():
    """Make a plant that hovers 50 m up, where no ground is met."""

    def make(vehicle, wind=CALM, **options):
        return Plant(vehicle, wind, seed=1, airborne_at_enu_m=(0.0, 0.0, 50.0), **options)

    return make
