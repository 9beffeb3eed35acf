"""A load changes the mass, from its moment on, and nothing else of the vehicle."""

import pytest

from sitl_shim.plant.payload import loaded
from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.vehicle import GRAVITY_M_S2, load_vehicle
from sitl_shim.wind import CALM, Load
from sitl_shim.wind.field import SteadyWind


def states(plant, signals, steps):
    return [plant.step(signals) for _ in range(steps)]


def load(at_s, mass_kg):
    return Load(at_s=at_s, mass_kg=mass_kg)


def test_it_falls_away_from_the_moment_on_with_what_its_rotors_no_longer_carry(vehicle, airborne):
    fifth = 0.2 * vehicle.mass_kg
    plant = airborne(vehicle, events=(load(0.1, fifth),))
    flown = states(plant, [vehicle.hover_signal] * 4, 50)
    vertical = [state.acceleration_enu_m_s2[2] for state in flown]
    assert vertical[:24] == pytest.approx([0.0] * 24, abs=1e-9)
    assert flown[24].time_s == pytest.approx(0.1)
    # T = m g still, so that the sum of forces is T - 1.2 m g on a mass of 1.2 m.
    assert vertical[24] == pytest.approx(-GRAVITY_M_S2 / 6.0, rel=1e-6)
    assert flown[24].velocity_enu_m_s[2] == pytest.approx(0.0, abs=1e-9)
    assert flown[-1].velocity_enu_m_s[2] < -0.15


def test_hover_takes_more_thrust_by_the_ratio_of_the_masses(vehicle, airborne):
    plant = airborne(vehicle, events=(load(0.0, 0.2 * vehicle.mass_kg),))
    assert sum(plant.state.rotor_thrust_n) == pytest.approx(1.2 * vehicle.mass_kg * GRAVITY_M_S2)
    heavier = vehicle.model_copy(update={"mass_kg": 1.2 * vehicle.mass_kg})
    flown = states(plant, [heavier.hover_signal] * 4, 250)
    assert flown[-1].position_enu_m == pytest.approx((0.0, 0.0, 50.0), abs=1e-9)


def test_a_released_load_leaves_the_vehicle_as_it_was(vehicle, airborne):
    plant = airborne(vehicle, events=(load(0.0, 0.1), load(0.2, 0.0)))
    flown = states(plant, [vehicle.hover_signal] * 4, 60)
    assert flown[48].acceleration_enu_m_s2[2] < -0.1
    # What is left is the drag of the speed that it has got meanwhile.
    assert flown[49].acceleration_enu_m_s2[2] == pytest.approx(0.0, abs=0.3)
    assert flown[49].acceleration_enu_m_s2[2] > 0.0


def test_the_force_of_the_wind_stays_so_that_its_push_per_mass_falls(ideal, airborne):
    vehicle = ideal(load_vehicle("bebop2"))
    wind = SteadyWind((3.0, 1.0, 0.0))
    own = airborne(vehicle, wind).state.wind_acceleration_enu_m_s2
    loaded = airborne(vehicle, wind, events=(load(0.0, 0.1),)).state.wind_acceleration_enu_m_s2
    assert loaded == pytest.approx([component / 1.2 for component in own])
    assert own[0] > 0.3


def test_turning_does_not_feel_it(vehicle, airborne):
    signal = vehicle.hover_signal
    signals = [1.05 * signal, signal, signal, 1.05 * signal]
    bare = states(airborne(vehicle), signals, 25)[-1]
    loaded = states(airborne(vehicle, events=(load(0.0, 0.1),)), signals, 25)[-1]
    # The rotors start from another signal, so only about alike.
    assert loaded.rate_flu_rad_s == pytest.approx(bare.rate_flu_rad_s, rel=0.35, abs=1e-9)
    late = states(airborne(vehicle, events=(load(0.004, 0.1),)), signals, 25)[-1]
    assert late.rate_flu_rad_s == pytest.approx(bare.rate_flu_rad_s, rel=1e-9, abs=1e-12)


def test_loaded_on_the_ground_it_stands_and_needs_more_to_leave(vehicle):
    plant = Plant(vehicle, CALM, seed=1, events=(load(0.5, 0.2 * vehicle.mass_kg),))
    # Enough for itself, not for the load.
    enough = 1.05 * vehicle.hover_signal
    flown = states(plant, [0.0] * 4, 130) + states(plant, [enough] * 4, 250)
    assert all(state.on_ground for state in flown)
    assert flown[-1].position_enu_m == (0.0, 0.0, 0.0)
    bare = Plant(vehicle, CALM, seed=1)
    assert not states(bare, [enough] * 4, 250)[-1].on_ground


def test_a_heavier_vehicle_that_keeps_its_height_draws_more_power(ideal, airborne):
    vehicle = ideal(load_vehicle("bebop2"))
    heavier = vehicle.model_copy(update={"mass_kg": 0.6})
    bare = states(airborne(vehicle), [vehicle.hover_signal] * 4, 2500)[-1]
    plant = airborne(vehicle, events=(load(0.0, 0.1),))
    loaded = states(plant, [heavier.hover_signal] * 4, 2500)[-1]
    assert loaded.battery_remaining < bare.battery_remaining
    assert loaded.battery_voltage_v < bare.battery_voltage_v


def test_a_load_too_heavy_to_lift_drags_it_down_from_the_start(vehicle, airborne):
    plant = airborne(vehicle, events=(load(0.0, 20.0 * vehicle.mass_kg),))
    assert states(plant, [1.0] * 4, 50)[-1].velocity_enu_m_s[2] < -0.5


@pytest.mark.parametrize("name", ["bebop2", "x500", "sih_quadx", "arducopter"])
def test_a_share_is_of_the_mass_of_the_vehicle_that_carries_it(name):
    vehicle = load_vehicle(name)
    heavier = loaded(vehicle, Load(at_s=0.0, mass_share=0.15))
    assert heavier.mass_kg == pytest.approx(1.15 * vehicle.mass_kg)
    assert heavier.model_copy(update={"mass_kg": vehicle.mass_kg}) == vehicle


@pytest.mark.parametrize("masses", [{}, {"mass_kg": 0.1, "mass_share": 0.1}])
def test_a_load_has_one_mass(masses):
    with pytest.raises(ValueError, match="either mass_kg or mass_share"):
        Load(at_s=0.0, **masses)


def test_dropped_it_climbs_with_what_its_rotors_no_longer_carry(vehicle, airborne):
    share = (Load(at_s=0.0, mass_share=0.15), Load(at_s=0.1, mass_share=0.0))
    heavier = loaded(vehicle, share[0])
    flown = states(airborne(vehicle, events=share), [heavier.hover_signal] * 4, 25)
    assert flown[23].acceleration_enu_m_s2[2] == pytest.approx(0.0, abs=1e-9)
    assert flown[24].acceleration_enu_m_s2[2] == pytest.approx(0.15 * GRAVITY_M_S2)
