from pathlib import Path

import pytest

from sitl_shim.plant.vehicle import load_vehicle
from sitl_shim.wind import CALM, load_scenario, make_wind, scenario_path
from sitl_shim.wind.field import SteadyWind, SumOfWinds

EVENTS = ["mass-step", "payload-drop", "gust-front", "weak-motor"]
NAMES = ["calm", "wind3", "gusts", "fan-1", "fan-2", "fan-3", "fan-4", "fan-5", *EVENTS]
HERE = (0.3, -0.2, 1.2)


@pytest.mark.parametrize("name", NAMES)
def test_every_scenario_has_the_name_of_its_file_and_makes_a_wind(name):
    scenario = load_scenario(name)
    assert scenario.name == name
    velocity = make_wind(scenario, 1).velocity_enu_m_s(0.0, HERE)
    assert len(velocity) == 3


def test_there_are_no_other_scenarios():
    folder = scenario_path("calm").parent
    assert sorted(path.stem for path in folder.glob("*.yaml")) == sorted(NAMES)


def test_a_path_is_taken_as_such():
    path = Path("elsewhere/mine.yaml")
    assert scenario_path(path) == path
    assert scenario_path("elsewhere/mine.yaml") == path
    assert scenario_path("mine.yaml") == Path("mine.yaml")


def test_calm_is_calm():
    assert make_wind(load_scenario("calm"), 1).velocity_enu_m_s(3.0, HERE) == (0.0, 0.0, 0.0)
    assert CALM.velocity_enu_m_s(0.0, HERE) == (0.0, 0.0, 0.0)


def test_wind3_blows_steadily_at_3_m_s():
    wind = make_wind(load_scenario("wind3"), 1)
    velocity = wind.velocity_enu_m_s(0.0, HERE)
    assert sum(v * v for v in velocity) == pytest.approx(9.0)
    assert wind.velocity_enu_m_s(17.0, (9.0, 9.0, 9.0)) == velocity


def test_winds_add_up():
    both = SumOfWinds([SteadyWind((1.0, 2.0, 3.0)), SteadyWind((0.5, -2.0, 1.0))])
    assert both.velocity_enu_m_s(0.0, HERE) == (1.5, 0.0, 4.0)


def test_the_step_of_mass_is_calm_and_a_fifth_of_the_bebop2():
    scenario = load_scenario("mass-step")
    assert scenario.winds == ()
    assert [load.mass_kg for load in scenario.payload] == pytest.approx(
        [0.2 * load_vehicle("bebop2").mass_kg]
    )
