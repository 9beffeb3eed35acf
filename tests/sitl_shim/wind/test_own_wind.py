"""A wind that is a function of the caller's."""

import math

import pytest

from sitl_shim.simulation import ShimOptions, Simulation
from sitl_shim.wind import OwnWind


def test_it_gives_what_the_function_gives_as_plain_floats():
    wind = OwnWind(lambda time_s, position: (time_s, position[0], 3))
    assert wind.velocity_enu_m_s(2.0, (7.0, 0.0, 0.0)) == (2.0, 7.0, 3.0)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ((math.nan, 0.0, 0.0), "finite"),
        ((0.0, math.inf, 0.0), "finite"),
        ((0.0, 0.0, -100.5), "at most 100 m/s"),
        ((1.0, 2.0), "three numbers"),
        ("abc", "three numbers"),
        (None, "three numbers"),
    ],
)
def test_what_is_no_velocity_is_refused_with_the_time(given, says):
    with pytest.raises(ValueError, match=says) as caught:
        OwnWind(lambda time_s, position: given).velocity_enu_m_s(1.5, (0.0, 0.0, 0.0))
    assert "t = 1.5 s" in str(caught.value)


def test_it_blows_beside_the_scenarios_wind_at_each_step_and_in_time():
    times: list[float] = []

    def function(time_s: float, position: tuple[float, float, float]):
        times.append(time_s)
        return (4.0, 0.0, 0.0)

    pushes = {}
    for name, own in (("none", None), ("own", function)):
        options = ShimOptions(own_wind=own, airborne_at_enu_m=(0.0, 0.0, 1.5))
        simulation = Simulation(options)
        for _ in range(50):
            simulation.sense()
            simulation.control()
        pushes[name] = simulation.state.wind_acceleration_enu_m_s2[0]
    assert pushes["none"] == 0.0
    assert pushes["own"] > 0.5
    assert times == pytest.approx([0.004 * k for k in range(51)])
