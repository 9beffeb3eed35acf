import math

import pytest

from sitl_shim.frames import euler_from_quaternion, quaternion_from_euler, rotate
from sitl_shim.plant.ground import Ground
from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.vehicle import GRAVITY_M_S2, load_vehicle
from sitl_shim.wind.field import CALM, SteadyWind

STEP_S = 0.004


def on_ground(vehicle, wind=CALM):
    return Plant(vehicle, wind, seed=1)


def dropped(vehicle, height_m, spin_up=0.0):
    """A plant released from rest, rotors running down, perhaps with a kick of one rotor first."""
    plant = Plant(vehicle, CALM, seed=1, airborne_at_enu_m=(0.0, 0.0, height_m))
    hover = vehicle.hover_signal
    for _ in range(20):
        plant.step((hover * (1 + spin_up), hover, hover, hover))
    return plant


def test_standing_it_neither_sinks_nor_trembles(vehicle):
    plant = on_ground(vehicle)
    for _ in range(500):
        state = plant.step([0.0] * 4)
        assert state.position_enu_m == (0.0, 0.0, 0.0)
        assert state.velocity_enu_m_s == (0.0, 0.0, 0.0)
        assert state.acceleration_enu_m_s2 == (0.0, 0.0, 0.0)
        assert state.on_ground


def test_below_hover_thrust_it_stays_and_above_it_takes_off(vehicle):
    plant = on_ground(vehicle)
    hover = vehicle.hover_signal
    for _ in range(500):
        state = plant.step([0.98 * hover] * 4)
    assert state.on_ground
    assert state.position_enu_m == (0.0, 0.0, 0.0)
    for _ in range(500):
        state = plant.step([1.1 * hover] * 4)
    assert not state.on_ground
    assert state.position_enu_m[2] > 0.5


def test_it_lands_softly_and_stands(vehicle):
    plant = dropped(vehicle, 0.6)
    hover = vehicle.hover_signal
    heights = []
    for step in range(2500):
        # a sinking-speed loop, until it is down; then the rotors run out
        sinking = plant.state.velocity_enu_m_s[2] + 0.4
        lift = hover * (1.0 - 0.5 * sinking) if step < 1500 else 0.0
        heights.append(plant.step([lift] * 4).position_enu_m[2])
    assert min(heights) > -1e-3
    assert heights[-1] == pytest.approx(0.0, abs=1e-3)
    assert plant.state.on_ground
    assert plant.state.velocity_enu_m_s == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("height_m", [1.0, 30.0])
@pytest.mark.parametrize("spin_up", [0.0, 0.05, 0.6])
def test_a_hard_landing_in_any_attitude_comes_to_rest_on_the_ground(vehicle, height_m, spin_up):
    plant = dropped(vehicle, height_m, spin_up)
    ground_m = -vehicle.ground_contact.foot_depth_m
    fastest, lowest = 0.0, math.inf
    for _ in range(2500):
        before = math.hypot(*plant.state.velocity_enu_m_s)
        state = plant.step([0.0] * 4)
        if state.on_ground:
            # An impact may turn motion into rotation, but never adds speed.
            fastest = max(fastest, math.hypot(*state.velocity_enu_m_s) - before)
        lowest = min(lowest, state.position_enu_m[2])
    assert state.on_ground
    assert math.hypot(*state.velocity_enu_m_s) < 0.05
    assert math.hypot(*state.rate_flu_rad_s) < 0.3
    assert fastest < 1.0
    assert lowest > ground_m - 0.01
    points = [rotor.position_flu_m for rotor in vehicle.rotors]
    gear = vehicle.ground_contact
    points += [
        (sx * gear.foot_x_m, sy * gear.foot_y_m, -gear.foot_depth_m)
        for sx in (1, -1)
        for sy in (1, -1)
    ]
    heights = [
        state.position_enu_m[2] + rotate(state.attitude_flu_to_enu, point)[2] for point in points
    ]
    assert min(heights) > ground_m - 1e-3


def test_an_impulse_never_adds_energy(vehicle):
    ground = Ground(vehicle)
    for roll, pitch in ((0.0, 0.0), (0.3, -0.2), (1.4, 0.1), (3.0, 0.2)):
        attitude = quaternion_from_euler(roll, pitch, 0.4)
        motion = (1.5, -0.5, -3.0, *attitude, 2.0, -1.0, 3.0)
        met = ground.resolve(ground.height_enu_m, motion)
        assert met is not None
        _, after = met

        def energy(state):
            inertia = vehicle.inertia_kg_m2
            turning = sum(i * w * w for i, w in zip(inertia, state[7:], strict=True))
            return 0.5 * vehicle.mass_kg * sum(v * v for v in state[:3]) + 0.5 * turning

        assert energy(after) < energy(motion)
        assert after[2] > motion[2]


def test_sliding_it_is_braked_by_friction(ideal):
    vehicle = ideal(load_vehicle("bebop2"))
    ground = Ground(vehicle)
    # Moving sideways and pressed down by one step of gravity: friction takes mu g h.
    motion = (1.0, 0.0, -GRAVITY_M_S2 * STEP_S, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    met = ground.resolve(-1e-4, motion)
    assert met is not None
    lift, after = met
    assert lift == pytest.approx(1e-4)
    lost = 1.0 - after[0]
    assert lost == pytest.approx(vehicle.ground_contact.friction * GRAVITY_M_S2 * STEP_S, rel=0.15)


def test_a_wind_that_friction_withstands_does_not_move_it():
    vehicle = load_vehicle("sih_quadx")
    plant = on_ground(vehicle, SteadyWind((3.0, 0.0, 0.0)))
    for _ in range(500):
        state = plant.step([0.0] * 4)
    assert state.position_enu_m == (0.0, 0.0, 0.0)
    assert state.wind_acceleration_enu_m_s2 == pytest.approx((3.0, 0.0, 0.0))


def test_a_storm_moves_it():
    vehicle = load_vehicle("sih_quadx")
    plant = on_ground(vehicle, SteadyWind((9.0, 0.0, 0.0)))
    for _ in range(500):
        state = plant.step([0.0] * 4)
    assert state.position_enu_m[0] > 0.3


def test_one_sided_thrust_tips_it_over(vehicle):
    plant = on_ground(vehicle)
    rolls = []
    for _ in range(500):
        state = plant.step((0.0, 0.9, 0.9, 0.0))  # the left pair lifts the left side
        rolls.append(euler_from_quaternion(state.attitude_flu_to_enu)[0])
    assert max(rolls) > 0.5
    assert min(rolls[:50]) > -1e-6


def test_after_an_impact_no_touching_point_moves_into_the_ground(vehicle):
    ground = Ground(vehicle)
    gear = vehicle.ground_contact
    feet = [
        (sx * gear.foot_x_m, sy * gear.foot_y_m, -gear.foot_depth_m)
        for sx in (1, -1)
        for sy in (1, -1)
    ]
    motion = (0.3, -0.2, -2.0, 1.0, 0.0, 0.0, 0.0, 1.5, -1.0, 0.5)
    met = ground.resolve(-1e-3, motion)
    assert met is not None
    _, (_, _, vz, *_, p, q, _) = met
    for x, y, _ in feet:
        assert vz + p * y - q * x > -1e-3


def test_nothing_touches_while_it_is_higher_than_its_reach():
    ground = Ground(load_vehicle("bebop2"))
    level = (0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert ground.resolve(0.001, level) is None
    assert not ground.near(0.5)
    assert ground.near(0.05)
