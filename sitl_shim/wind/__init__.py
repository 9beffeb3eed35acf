"""Winds: functions of time and position, and the scenario files that name them and events."""

from sitl_shim.wind.events import Load, Moments, Motor, Timed
from sitl_shim.wind.field import CALM, SumOfWinds, Wind
from sitl_shim.wind.own import OwnWind, OwnWindFunction
from sitl_shim.wind.scenario import Scenario, load_scenario, make_wind, scenario_path

__all__ = [
    "CALM",
    "Load",
    "Moments",
    "Motor",
    "OwnWind",
    "OwnWindFunction",
    "Scenario",
    "SumOfWinds",
    "Timed",
    "Wind",
    "load_scenario",
    "make_wind",
    "scenario_path",
]
