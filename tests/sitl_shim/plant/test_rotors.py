import math

import pytest

from sitl_shim.plant.rotors import make_lag, make_thrusts, make_wrench, sane_commands
from sitl_shim.plant.vehicle import load_vehicle


@pytest.mark.parametrize(
    ("rotor", "roll", "pitch", "yaw"),
    [
        # A rotor on the right lifts the right side: negative roll.  One in front lifts the nose:
        # negative pitch.  One that turns counter-clockwise turns the body clockwise.
        (0, -1, -1, -1),
        (1, 1, 1, -1),
        (2, 1, -1, 1),
        (3, -1, 1, 1),
    ],
)
def test_each_rotor_alone_turns_the_body_its_own_way(vehicle, rotor, roll, pitch, yaw):
    thrusts = [0.0] * 4
    thrusts[rotor] = 2.0
    total, tx, ty, tz = make_wrench(vehicle)(tuple(thrusts))
    x, y, _ = vehicle.rotors[rotor].position_flu_m
    assert total == 2.0
    assert tx == pytest.approx(roll * 2.0 * abs(y))
    assert ty == pytest.approx(pitch * 2.0 * abs(x))
    assert tz == pytest.approx(yaw * 2.0 * vehicle.propulsion.torque_per_thrust_m)


def test_equal_thrusts_give_no_torque(vehicle):
    total, *torque = make_wrench(vehicle)((1.5, 1.5, 1.5, 1.5))
    assert total == 6.0
    assert torque == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)


def test_the_lag_reaches_63_percent_after_its_time_constant_at_any_step():
    for step_s in (0.05, 0.01, 0.002):
        advance = make_lag(0.05, step_s)
        signals = (0.0, 0.2, 1.0, 0.5)
        for _ in range(round(0.05 / step_s)):
            _, signals = advance(signals, (1.0, 1.0, 0.0, 0.5))
        rest = math.exp(-1.0)
        assert signals == pytest.approx((1 - rest, 1 - 0.8 * rest, rest, 0.5))


def test_two_half_steps_of_the_lag_are_one_step():
    mid, end = make_lag(0.035, 0.004)((0.1, 0.2, 0.3, 0.4), (0.9, 0.0, 0.5, 1.0))
    _, after_half = make_lag(0.035, 0.002)((0.1, 0.2, 0.3, 0.4), (0.9, 0.0, 0.5, 1.0))
    _, after_whole = make_lag(0.035, 0.002)(after_half, (0.9, 0.0, 0.5, 1.0))
    assert mid == pytest.approx(after_half)
    assert end == pytest.approx(after_whole)


def test_the_thrust_map_is_linear_or_quadratic_as_the_vehicle_says():
    signals = (0.0, 0.25, 0.5, 1.0)
    linear = make_thrusts(load_vehicle("sih_quadx"), 1.0)(signals)
    assert linear == pytest.approx((0.0, 1.25, 2.5, 5.0))
    quadratic = make_thrusts(load_vehicle("x500"), 1.0)(signals)
    assert quadratic == pytest.approx((0.0, 8.55 / 16, 8.55 / 4, 8.55))


def test_commands_within_range_pass_unchanged():
    assert sane_commands([0.0, 0.25, 0.5, 1.0]) == (0.0, 0.25, 0.5, 1.0)


def test_commands_out_of_range_are_clamped_and_what_is_no_number_stops_the_motor():
    assert sane_commands([-0.1, 1.7, math.nan, 0.5]) == (0.0, 1.0, 0.0, 0.5)
    assert sane_commands([math.inf, -math.inf, 0.5, 2]) == (0.0, 0.0, 0.5, 1.0)


@pytest.mark.parametrize("commands", [[], [0.5] * 3, [0.5] * 8])
def test_any_other_number_of_commands_is_refused(commands):
    with pytest.raises(ValueError, match="four rotor commands"):
        sane_commands(commands)
