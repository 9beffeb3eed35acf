import math

import pytest

from sitl_shim.frames import quaternion_from_euler, rotate
from sitl_shim.plant.rigid_body import make_derivative, make_drag_acceleration, runge_kutta_step
from sitl_shim.plant.vehicle import GRAVITY_M_S2, load_vehicle
from sitl_shim.wind.field import SteadyWind

NONE = (0.0, 0.0, 0.0, 0.0)
STILL_AIR = (0.0, 0.0, 0.0)


def dragless(vehicle):
    drag = vehicle.drag.model_copy(
        update={
            "linear_n_s_m": (0.0,) * 3,
            "quadratic_n_s2_m2": 0.0,
            "angular_n_m_s": (0.0,) * 3,
        }
    )
    return vehicle.model_copy(update={"drag": drag})


def coast(vehicle, motion, seconds, step_s=0.004):
    """Motion of a body without rotors."""
    derivative = make_derivative(vehicle)
    for _ in range(round(seconds / step_s)):
        first = derivative(motion, NONE, STILL_AIR)
        _, motion = runge_kutta_step(derivative, motion, first, NONE, NONE, STILL_AIR, step_s)
    return motion


def test_without_air_or_thrust_it_falls_freely(vehicle, airborne):
    bare = dragless(vehicle)
    derivative = make_derivative(bare)
    motion = (1.0, -2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    first = derivative(motion, NONE, STILL_AIR)
    reach, after = runge_kutta_step(derivative, motion, first, NONE, NONE, STILL_AIR, 0.5)
    assert reach == pytest.approx((0.5, -1.0, 1.5 - 0.125 * GRAVITY_M_S2))
    assert after[:3] == pytest.approx((1.0, -2.0, 3.0 - 0.5 * GRAVITY_M_S2))


def test_torque_free_rotation_keeps_angular_momentum_and_energy(vehicle):
    bare = dragless(vehicle)
    inertia = bare.inertia_kg_m2
    attitude = quaternion_from_euler(0.4, -0.3, 1.1)
    start = (0.0, 0.0, 0.0, *attitude, 4.0, -2.5, 3.0)

    def momentum(motion):
        body = tuple(i * w for i, w in zip(inertia, motion[7:], strict=True))
        return rotate(motion[3:7], body)

    def energy(motion):
        return 0.5 * sum(i * w * w for i, w in zip(inertia, motion[7:], strict=True))

    end = coast(bare, start, 4.0)
    assert momentum(end) == pytest.approx(momentum(start), rel=1e-5, abs=1e-8)
    assert energy(end) == pytest.approx(energy(start), rel=1e-5)
    # The test would be empty if the rates had not changed.
    assert max(abs(a - b) for a, b in zip(end[3:], start[3:], strict=True)) > 0.1


def test_a_lopsided_body_precesses_as_eulers_equations_say():
    vehicle = dragless(load_vehicle("bebop2"))
    ix, iy, iz = vehicle.inertia_kg_m2
    slope = make_derivative(vehicle)((0, 0, 0, 1, 0, 0, 0, 1.0, 2.0, 3.0), NONE, STILL_AIR)
    assert slope[7:] == pytest.approx(
        ((iy - iz) / ix * 6.0, (iz - ix) / iy * 3.0, (ix - iy) / iz * 2.0)
    )


def test_angular_damping_slows_each_axis_by_its_own_time_constant():
    vehicle = load_vehicle("sih_quadx")
    drag = vehicle.drag.model_copy(update={"angular_n_m_s": (0.025, 0.05, 0.06)})
    damped = vehicle.model_copy(update={"drag": drag})
    for axis, time_s in enumerate((1.0, 0.5, 0.5)):  # inertia over damping
        rate = [0.0, 0.0, 0.0]
        rate[axis] = 2.0
        end = coast(damped, (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, *rate), 0.5)
        assert end[7 + axis] == pytest.approx(2.0 * math.exp(-0.5 / time_s), rel=1e-6)


def test_the_quaternion_turns_at_the_body_rate():
    vehicle = dragless(load_vehicle("sih_quadx"))
    end = coast(vehicle, (0, 0, 0, 1.0, 0, 0, 0, 0.0, 0.0, 0.5), 2.0)
    assert end[3:7] == pytest.approx(quaternion_from_euler(0.0, 0.0, 1.0), abs=1e-9)


def test_thrust_acts_along_the_bodys_vertical():
    vehicle = dragless(load_vehicle("bebop2"))
    attitude = quaternion_from_euler(0.0, 0.3, math.pi / 2)  # nose north, and down
    slope = make_derivative(vehicle)((0, 0, 0, *attitude, 0, 0, 0), (5.0, 0, 0, 0), STILL_AIR)
    expected = (0.0, 10.0 * math.sin(0.3), 10.0 * math.cos(0.3) - GRAVITY_M_S2)
    assert slope[:3] == pytest.approx(expected)


def test_bebop2s_drag_per_mass_is_015_v_plus_002_v_squared_in_any_attitude():
    drag = make_drag_acceleration(load_vehicle("bebop2"))
    for attitude in ((1.0, 0.0, 0.0, 0.0), quaternion_from_euler(0.3, -0.2, 2.0)):
        x, y, z = drag(attitude, (3.0, 0.0, -4.0))
        assert (x, y, z) == pytest.approx((-0.25 * 3.0, 0.0, 0.25 * 4.0))


def test_linear_drag_goes_with_the_bodys_axes():
    drag = make_drag_acceleration(load_vehicle("x500"))
    # On its side, the x500 meets air from the side with its smaller vertical drag.
    upright = drag((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    on_its_side = drag(quaternion_from_euler(math.pi / 2, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert upright[1] == pytest.approx(-(0.40 + 0.03) / 2.0)
    assert on_its_side == pytest.approx((0.0, -(0.20 + 0.03) / 2.0, 0.0))


def test_the_drag_reported_is_the_drag_that_moves_it(vehicle):
    attitude = quaternion_from_euler(0.5, -0.4, 0.9)
    velocity, wind = (3.0, -1.0, 2.0), (-2.0, 4.0, 0.5)
    relative = tuple(v - w for v, w in zip(velocity, wind, strict=True))
    slope = make_derivative(vehicle)((*velocity, *attitude, 0, 0, 0), NONE, wind)
    x, y, z = make_drag_acceleration(vehicle)(attitude, relative)
    assert slope[:3] == pytest.approx((x, y, z - GRAVITY_M_S2))


def test_integration_is_of_fourth_order(vehicle, airborne):
    """Halving the step divides the error by about 16, in a tumbling flight through wind."""

    def fly(step_s):
        plant = airborne(vehicle, SteadyWind((3.0, -2.0, 0.5)), step_s=step_s)
        hover = vehicle.hover_signal
        for _ in range(round(0.32 / step_s)):
            plant.step((hover * 1.2, hover * 1.1, hover * 1.14, hover * 1.05))
        state = plant.state
        return (
            *state.position_enu_m,
            *state.velocity_enu_m_s,
            *state.attitude_flu_to_enu,
            *state.rate_flu_rad_s,
        )

    def error(a, b):
        return math.sqrt(sum((x - y) ** 2 for x, y in zip(a, b, strict=True)))

    exact = fly(0.001)
    errors = [error(fly(step_s), exact) for step_s in (0.032, 0.016, 0.008)]
    orders = [math.log2(errors[i] / errors[i + 1]) for i in range(2)]
    assert orders == pytest.approx([4.0, 4.0], abs=0.35)
