import math

import pytest

from sitl_shim.plant.vehicle import GRAVITY_M_S2, load_vehicle, signal_for_thrust
from sitl_shim.sensors.profile import load_profile

NAMES = ["bebop2", "x500", "sih_quadx"]


@pytest.mark.parametrize("name", NAMES)
def test_every_vehicle_is_a_balanced_quad_x_in_the_order_of_px4(name):
    vehicle = load_vehicle(name)
    assert vehicle.name == name
    quadrants = [
        (math.copysign(1, r.position_flu_m[0]), math.copysign(1, r.position_flu_m[1]), r.spin)
        for r in vehicle.rotors
    ]
    assert quadrants == [(1, -1, "ccw"), (-1, 1, "ccw"), (1, 1, "cw"), (-1, -1, "cw")]
    for axis in range(2):
        assert sum(r.position_flu_m[axis] for r in vehicle.rotors) == pytest.approx(0.0)


@pytest.mark.parametrize("name", NAMES)
def test_every_vehicles_inertia_is_one_that_a_body_can_have(name):
    x, y, z = load_vehicle(name).inertia_kg_m2
    assert x <= y + z
    assert y <= x + z
    assert z <= x + y


@pytest.mark.parametrize("name", NAMES)
def test_every_vehicle_names_a_sensor_profile_that_exists(name):
    profile = load_vehicle(name).sensor_profile
    assert load_profile(profile).name == profile


def test_bebop2_is_pinned():
    vehicle = load_vehicle("bebop2")
    mass = vehicle.mass_kg
    assert [d / mass for d in vehicle.drag.linear_n_s_m] == pytest.approx([0.15] * 3)
    assert vehicle.drag.quadratic_n_s2_m2 / mass == pytest.approx(0.02)
    assert (vehicle.telemetry_delay_s, vehicle.command_delay_s) == (0.015, 0.015)
    assert (vehicle.spread.thrust_fraction, vehicle.spread.trim_deg) == (0.03, 0.8)
    assert 0.03 <= vehicle.propulsion.time_constant_s <= 0.04
    assert vehicle.hover_signal == pytest.approx(0.5, abs=0.02)
    assert 4 * vehicle.propulsion.max_thrust_n >= 2.0 * mass * GRAVITY_M_S2
    profile = load_profile(vehicle.sensor_profile)
    assert profile.position_noise_m == (0.001,) * 3
    assert profile.velocity_noise_m_s == (0.015,) * 3
    assert (profile.pose_delay_s, profile.pose_rate_hz, profile.drift) == (0.0, 0.0, None)


def test_sih_quadx_has_the_figures_of_px4s_own_simulation():
    vehicle = load_vehicle("sih_quadx")
    assert vehicle.mass_kg == 1.0
    assert vehicle.inertia_kg_m2 == (0.025, 0.025, 0.030)
    assert {abs(c) for r in vehicle.rotors for c in r.position_flu_m[:2]} == {0.2}
    propulsion = vehicle.propulsion
    assert (propulsion.max_thrust_n, propulsion.time_constant_s) == (5.0, 0.05)
    assert propulsion.max_thrust_n * propulsion.torque_per_thrust_m == pytest.approx(0.1)
    assert vehicle.drag.linear_n_s_m == (1.0, 1.0, 1.0)
    assert vehicle.hover_signal == pytest.approx(0.49, abs=0.005)


@pytest.mark.parametrize("shape", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("fraction", [0.0, 0.2, 0.57, 1.0])
def test_the_signal_for_a_thrust_undoes_the_thrust_curve(shape, fraction):
    signal = signal_for_thrust(fraction, shape)
    assert shape * signal**2 + (1 - shape) * signal == pytest.approx(fraction)
