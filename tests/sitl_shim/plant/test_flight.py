import math

import pytest

from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.vehicle import GRAVITY_M_S2, load_vehicle
from sitl_shim.wind import load_scenario, make_wind
from sitl_shim.wind.field import CALM, SteadyWind


def run(plant, commands, seconds):
    for _ in range(round(seconds / 0.004)):
        plant.step(commands)
    return plant.state


def test_at_hover_thrust_it_stays_where_it_is(vehicle, airborne):
    plant = airborne(vehicle)
    state = run(plant, [vehicle.hover_signal] * 4, 5.0)
    assert state.position_enu_m == pytest.approx((0.0, 0.0, 50.0), abs=1e-9)
    assert sum(state.rotor_thrust_n) == pytest.approx(vehicle.mass_kg * GRAVITY_M_S2)
    assert not state.on_ground


def test_an_airborne_start_is_a_hover_at_the_place_asked_for(vehicle):
    plant = Plant(vehicle, CALM, seed=3, airborne_at_enu_m=(1.0, -2.0, 1.5))
    assert plant.state.position_enu_m == (1.0, -2.0, 1.5)
    assert plant.state.time_s == 0.0
    assert plant.state.acceleration_enu_m_s2 == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    state = plant.step([vehicle.hover_signal] * 4)
    assert state.time_s == 0.004
    assert state.position_enu_m == pytest.approx((1.0, -2.0, 1.5))


def test_rotors_stopped_in_the_air_it_falls(vehicle, airborne):
    plant = airborne(vehicle)
    state = run(plant, [0.0] * 4, 1.0)
    assert state.velocity_enu_m_s[2] < -5.0
    assert state.velocity_enu_m_s[:2] == (0.0, 0.0)


def test_in_a_steady_wind_it_ends_up_moving_with_the_air(vehicle, airborne):
    plant = airborne(vehicle, SteadyWind((2.0, -1.5, 0.0)))
    state = run(plant, [vehicle.hover_signal] * 4, 80.0)
    assert state.velocity_enu_m_s == pytest.approx((2.0, -1.5, 0.0), abs=2e-3)
    # Once it moves with the wind, the wind's push is what replaces the drag of still air.
    assert math.hypot(*state.acceleration_enu_m_s2) < 1e-3


def test_falling_it_reaches_the_speed_at_which_drag_is_weight(ideal, airborne):
    vehicle = ideal(load_vehicle("bebop2"))
    plant = Plant(vehicle, CALM, seed=1, airborne_at_enu_m=(0.0, 0.0, 5000.0))
    speed = -run(plant, [0.0] * 4, 30.0).velocity_enu_m_s[2]
    assert 0.15 * speed + 0.02 * speed**2 == pytest.approx(GRAVITY_M_S2, rel=1e-6)


@pytest.mark.parametrize(
    ("stronger", "signs"),
    [((2, 1), (1, 0, 0)), ((1, 3), (0, 1, 0)), ((2, 3), (0, 0, 1)), ((0, 3), (-1, 0, 0))],
)
def test_a_pair_of_stronger_rotors_turns_it_about_one_axis(vehicle, airborne, stronger, signs):
    hover = vehicle.hover_signal
    commands = [hover + (0.02 if rotor in stronger else -0.02) for rotor in range(4)]
    rate = run(airborne(vehicle), commands, 0.05).rate_flu_rad_s
    for value, sign in zip(rate, signs, strict=True):
        assert abs(value) < 1e-9 if sign == 0 else value * sign > 1e-3


def test_the_wind_acceleration_is_the_drag_that_the_wind_adds(ideal, airborne):
    vehicle = ideal(load_vehicle("bebop2"))
    plant = airborne(vehicle, SteadyWind((4.0, 0.0, 0.0)))
    assert plant.state.wind_acceleration_enu_m_s2 == pytest.approx((0.92, 0.0, 0.0))
    assert plant.state.acceleration_enu_m_s2 == pytest.approx((0.92, 0.0, 0.0))
    state = run(plant, [vehicle.hover_signal] * 4, 1.0)
    v = state.velocity_enu_m_s[0]
    relative = 4.0 - v
    expected = 0.15 * relative + 0.02 * relative**2 + 0.15 * v + 0.02 * v**2
    assert state.wind_acceleration_enu_m_s2 == pytest.approx((expected, 0.0, 0.0), abs=1e-9)


def test_in_still_air_there_is_no_wind_acceleration(vehicle, airborne):
    state = run(airborne(vehicle), [0.3, 0.35, 0.3, 0.3], 0.5)
    assert state.wind_acceleration_enu_m_s2 == (0.0, 0.0, 0.0)


def test_the_acceleration_is_the_slope_of_the_velocity(vehicle, airborne):
    plant = airborne(vehicle, SteadyWind((3.0, 1.0, 0.0)))
    hover = vehicle.hover_signal
    commands = (hover * 1.1, hover, hover * 1.05, hover)
    states = [plant.step(commands) for _ in range(60)]
    before, now, after = states[40:43]
    slope = [
        (b - a) / 0.008
        for a, b in zip(before.velocity_enu_m_s, after.velocity_enu_m_s, strict=True)
    ]
    assert now.acceleration_enu_m_s2 == pytest.approx(slope, abs=2e-3)


def fly_about(name, scenario, seed):
    """A minute-like mix of commands: off the ground, over to one side, and into it."""
    vehicle = load_vehicle(name)
    plant = Plant(vehicle, make_wind(load_scenario(scenario), seed), seed=seed)
    hover = vehicle.hover_signal
    states = [plant.state]
    for step in range(1200):
        lift = hover * (1.15 if step < 500 else 0.9)
        states.append(plant.step((lift, lift * 1.001, lift, lift)))
    return states


@pytest.mark.parametrize("scenario", ["gusts", "fan-4"])
def test_one_seed_gives_one_trajectory_bit_for_bit(scenario):
    assert fly_about("bebop2", scenario, 7) == fly_about("bebop2", scenario, 7)


def test_another_seed_gives_another_trajectory_even_in_still_air():
    assert fly_about("bebop2", "calm", 7)[-1] != fly_about("bebop2", "calm", 8)[-1]


def test_thrust_spreads_over_seeds_by_at_most_what_the_vehicle_says():
    vehicle = load_vehicle("bebop2")
    nominal = vehicle.mass_kg * GRAVITY_M_S2
    scales = [
        sum(Plant(vehicle, CALM, seed=seed, airborne_at_enu_m=(0.0, 0.0, 9.0)).state.rotor_thrust_n)
        / nominal
        for seed in range(200)
    ]
    assert 0.97 <= min(scales) < 0.975
    assert 1.025 < max(scales) <= 1.03


def test_no_number_as_a_command_stops_that_rotor_and_nothing_else(vehicle, airborne):
    hover = vehicle.hover_signal
    by_nan = run(airborne(vehicle), (hover, math.nan, hover, hover), 0.1)
    by_zero = run(airborne(vehicle), (hover, 0.0, hover, hover), 0.1)
    assert by_nan == by_zero
    assert all(math.isfinite(c) for c in (*by_nan.position_enu_m, *by_nan.attitude_flu_to_enu))


def test_the_quaternion_keeps_its_norm_however_long_it_tumbles(vehicle, airborne):
    plant = airborne(vehicle)
    hover = vehicle.hover_signal
    run(plant, (hover * 1.05, hover, hover, hover), 3.0)
    assert math.hypot(*plant.state.attitude_flu_to_enu) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("step_s", [0.0, -0.004, math.nan])
def test_a_step_that_is_no_step_is_refused(vehicle, step_s):
    with pytest.raises(ValueError, match="step_s"):
        Plant(vehicle, CALM, seed=1, step_s=step_s)
