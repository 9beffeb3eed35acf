"""A motor that weakens pushes less from its moment on, and its reaction torque falls alike."""

import pytest

from sitl_shim.wind import Motor


def weakened(rotor, factor, at_s=0.1):
    return Motor(at_s=at_s, rotor=rotor, thrust_factor=factor)


def fly(plant, signals, steps):
    return [plant.step(signals) for _ in range(steps)]


@pytest.mark.parametrize("rotor", [1, 2, 3, 4])
def test_one_rotor_has_the_factor_and_the_others_none(rotor, vehicle, airborne):
    flown = fly(airborne(vehicle, events=(weakened(rotor, 0.9),)), [vehicle.hover_signal] * 4, 30)
    before, after = flown[23].rotor_thrust_n, flown[25].rotor_thrust_n
    for index in range(4):
        factor = 0.9 if index + 1 == rotor else 1.0
        assert after[index] == pytest.approx(factor * before[index], rel=1e-9)


def test_the_front_right_one_lets_its_corner_sink_and_the_nose_turn_after_it(vehicle, airborne):
    state = fly(airborne(vehicle, events=(weakened(1, 0.8),)), [vehicle.hover_signal] * 4, 40)[-1]
    roll, pitch, yaw = state.rate_flu_rad_s
    assert roll > 0.0  # FLU: to the right
    assert pitch > 0.0  # nose down
    # It turns counter-clockwise and pushes the body clockwise: less of that turns it the other way.
    assert yaw > 0.0


def test_it_sinks_by_the_share_that_is_missing(vehicle, airborne):
    flown = fly(airborne(vehicle, events=(weakened(2, 0.9),)), [vehicle.hover_signal] * 4, 26)
    acceleration = flown[24].acceleration_enu_m_s2[2]
    assert flown[23].acceleration_enu_m_s2[2] == pytest.approx(0.0, abs=1e-9)
    assert flown[25].acceleration_enu_m_s2[2] == pytest.approx(-0.025 * 9.80665, rel=1e-2)
    assert acceleration == pytest.approx(0.0, abs=0.3)


def test_several_weaken_each_for_itself_and_one_recovers(vehicle, airborne):
    events = (weakened(1, 0.5), weakened(3, 0.7), weakened(1, 1.0, at_s=0.2))
    flown = fly(airborne(vehicle, events=events), [vehicle.hover_signal] * 4, 60)
    sound = flown[0].rotor_thrust_n[0]
    assert [t / sound for t in flown[30].rotor_thrust_n] == pytest.approx([0.5, 1.0, 0.7, 1.0])
    assert [t / sound for t in flown[55].rotor_thrust_n] == pytest.approx([1.0, 1.0, 0.7, 1.0])
