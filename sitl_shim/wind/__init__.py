"""Winds: functions of time and position, and the scenario files that name them."""

from sitl_shim.wind.field import CALM, Wind
from sitl_shim.wind.scenario import Load, Scenario, load_scenario, make_wind, scenario_path

__all__ = ["CALM", "Load", "Scenario", "Wind", "load_scenario", "make_wind", "scenario_path"]
