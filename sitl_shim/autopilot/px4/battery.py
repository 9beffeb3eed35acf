"""When PX4 finds the battery low, and what it does then.

Levels and actions: https://docs.px4.io/main/en/config/safety.html#battery-level-failsafe.
"""

from enum import IntEnum

from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.failsafe import Action, Cause, CauseNumber


class BatteryLevel(IntEnum):
    """PX4's warnings, from none to the last."""

    NONE = 0
    LOW = 1
    CRITICAL = 2
    EMERGENCY = 3


_WARN_ONLY, _RETURN, _LAND, _RETURN_OR_LAND = 0, 1, 2, 3
"""Values of COM_LOW_BAT_ACT."""
_ACTIONS = {
    (BatteryLevel.CRITICAL, _RETURN): Action.RETURN,
    (BatteryLevel.CRITICAL, _LAND): Action.LAND,
    (BatteryLevel.CRITICAL, _RETURN_OR_LAND): Action.RETURN,
    (BatteryLevel.EMERGENCY, _RETURN): Action.RETURN,
    (BatteryLevel.EMERGENCY, _LAND): Action.LAND,
    (BatteryLevel.EMERGENCY, _RETURN_OR_LAND): Action.LAND,
}
_NUMBERS = {
    BatteryLevel.LOW: CauseNumber.BATTERY_LOW,
    BatteryLevel.CRITICAL: CauseNumber.BATTERY_CRITICAL,
    BatteryLevel.EMERGENCY: CauseNumber.BATTERY_EMERGENCY,
}


def battery_level(remaining: float, parameters: ParameterStore) -> BatteryLevel:
    """The warning for a share of the charge."""
    if remaining < parameters["BAT_EMERGEN_THR"]:
        return BatteryLevel.EMERGENCY
    if remaining < parameters["BAT_CRIT_THR"]:
        return BatteryLevel.CRITICAL
    return BatteryLevel.LOW if remaining < parameters["BAT_LOW_THR"] else BatteryLevel.NONE


def battery_cause(
    level: BatteryLevel, at_arming: BatteryLevel, parameters: ParameterStore
) -> Cause | None:
    """What a level asks for; no more than a warning if it was as low when the vehicle was armed."""
    if level is BatteryLevel.NONE:
        return None
    action = _ACTIONS.get((level, parameters.integer("COM_LOW_BAT_ACT")), Action.WARN)
    if level <= at_arming:
        action = Action.WARN
    return Cause(f"battery {level.name}", action, _NUMBERS[level])
