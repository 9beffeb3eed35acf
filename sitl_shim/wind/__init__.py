"""Winds: functions of time and position, named by scenario files."""

from sitl_shim.wind.field import CALM, Wind
from sitl_shim.wind.scenario import Scenario, load_scenario, make_wind, scenario_path

__all__ = ["CALM", "Scenario", "Wind", "load_scenario", "make_wind", "scenario_path"]
