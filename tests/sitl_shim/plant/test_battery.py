import pytest

from sitl_shim.plant.battery import BatteryPack
from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.vehicle import load_vehicle
from sitl_shim.wind.field import CALM


@pytest.fixture
def pack():
    return BatteryPack(load_vehicle("x500").battery)


def test_a_new_battery_is_full(pack):
    assert (pack.remaining, pack.voltage_v, pack.signal_factor) == (1.0, 16.8, 1.0)


def test_load_lowers_the_voltage_by_current_times_resistance(pack):
    for _ in range(20):
        pack.draw((1.0, 1.0, 1.0, 1.0), 1e-6)
    # P = 710 W, V = 16.8 - 0.02 P / V
    assert pack.voltage_v == pytest.approx(16.8 - 0.02 * 710.0 / pack.voltage_v, abs=1e-4)
    pack.draw((0.0, 0.0, 0.0, 0.0), 1e-6)
    assert pack.voltage_v > 16.7


def test_an_hour_at_the_capacity_in_amperes_empties_it(pack):
    power_w = 10.0
    hours = 0.0
    while pack.remaining > 0.5:
        pack.draw((0.0, 0.0, 0.0, 0.0), 10.0)
        hours += 10.0 / 3600.0
    mean_voltage_v = 0.5 * (16.8 + 0.5 * (16.8 + 14.0))
    assert hours == pytest.approx(0.5 * 5.0 * mean_voltage_v / power_w, rel=2e-3)


def test_an_empty_battery_stays_finite(pack):
    for _ in range(1000):
        pack.draw((1.0, 1.0, 1.0, 1.0), 10.0)
    assert pack.remaining == 0.0
    assert 7.0 <= pack.voltage_v < 14.0


def test_thrust_sags_mildly_with_the_voltage():
    vehicle = load_vehicle("x500")
    plant = Plant(vehicle, CALM, seed=1, airborne_at_enu_m=(0.0, 0.0, 50.0))
    fresh = sum(plant.state.rotor_thrust_n)
    for _ in range(250):
        plant.step([vehicle.hover_signal] * 4)
    state = plant.state
    assert state.battery_voltage_v < 16.6
    assert 0.95 * fresh < sum(state.rotor_thrust_n) < fresh
    assert 0.99 < state.battery_remaining < 1.0


def test_px4s_own_simulation_has_no_sag():
    vehicle = load_vehicle("sih_quadx")
    plant = Plant(vehicle, CALM, seed=1, airborne_at_enu_m=(0.0, 0.0, 50.0))
    for _ in range(1000):
        plant.step([vehicle.hover_signal] * 4)
    assert plant.state.position_enu_m[2] == pytest.approx(50.0, abs=1e-9)
