"""When ArduPilot finds the battery low or critical.

https://ardupilot.org/copter/docs/failsafe-battery.html: a voltage must be too low for
BATT_LOW_TIMER, a charge counts at once; what was found low does not recover.
"""

from enum import IntEnum

from sitl_shim.autopilot.interface import BatteryReport
from sitl_shim.autopilot.parameters import ParameterStore


class BatteryState(IntEnum):
    """From good to worst."""

    GOOD = 0
    LOW = 1
    CRITICAL = 2


_LIMITS = (
    (BatteryState.LOW, "BATT_LOW_VOLT", "BATT_LOW_MAH"),
    (BatteryState.CRITICAL, "BATT_CRT_VOLT", "BATT_CRT_MAH"),
)


class BatteryWatch:
    """Compares what the battery says with the limits.

    Args:
        parameters: BATT_*.
    """

    __slots__ = ("_below_since_us", "_parameters", "state")

    def __init__(self, parameters: ParameterStore) -> None:
        self._parameters = parameters
        self._below_since_us: dict[BatteryState, int] = {}
        self.state = BatteryState.GOOD

    def action(self) -> int:
        """What BATT_FS_LOW_ACT or BATT_FS_CRT_ACT asks for in the present state."""
        name = "BATT_FS_LOW_ACT" if self.state is BatteryState.LOW else "BATT_FS_CRT_ACT"
        return self._parameters.integer(name)

    def used_mah(self, report: BatteryReport) -> float:
        """What has been drawn, mAh."""
        return self._parameters["BATT_CAPACITY"] * (1.0 - report.remaining)

    def look(self, time_us: int, report: BatteryReport) -> bool:
        """Whether the state became worse just now."""
        worst = self.state
        p = self._parameters
        left_mah = p["BATT_CAPACITY"] * report.remaining
        for state, voltage, charge in _LIMITS:
            if state > worst and (
                self._sags(state, p[voltage], time_us, report) or left_mah < p[charge]
            ):
                worst = state
        worse = worst > self.state
        self.state = worst
        return worse

    def _sags(
        self, state: BatteryState, limit_v: float, time_us: int, report: BatteryReport
    ) -> bool:
        """Whether the voltage has been below a limit for long enough."""
        if report.voltage_v >= limit_v:
            self._below_since_us.pop(state, None)
            return False
        since_us = self._below_since_us.setdefault(state, time_us)
        return time_us - since_us >= self._parameters["BATT_LOW_TIMER"] * 1e6
