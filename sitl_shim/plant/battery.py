"""The battery: charge drawn, voltage under load, and what the motors make of it."""

from sitl_shim.compiled import FLOAT, compiled
from sitl_shim.plant.equations import Cells, discharge
from sitl_shim.plant.vehicle import Battery

_SECONDS_PER_HOUR = 3600.0


class BatteryPack:
    """One battery, full at first."""

    __slots__ = ("_discharge", "_model", "cells", "remaining", "voltage_v")

    def __init__(self, model: Battery) -> None:
        self._model = model
        self._discharge = compiled(discharge, 6, FLOAT, FLOAT, 4, FLOAT)
        self.cells: Cells = (
            model.idle_power_w,
            model.full_power_w,
            model.empty_voltage_v,
            model.full_voltage_v,
            model.resistance_ohm,
            _SECONDS_PER_HOUR * model.capacity_a_h,
        )
        """For `equations.discharge`."""
        self.remaining = 1.0
        self.voltage_v = model.full_voltage_v

    @property
    def signal_factor(self) -> float:
        """What the motors reach of a command at the present voltage."""
        exponent = self._model.voltage_exponent
        if exponent == 0.0:
            return 1.0
        return float((self.voltage_v / self._model.full_voltage_v) ** exponent)

    def draw(self, signals: tuple[float, float, float, float], step_s: float) -> None:
        """Draw the power of the avionics and of the motors for one step."""
        self.remaining, self.voltage_v = self._discharge(
            self.cells, self.remaining, self.voltage_v, signals, step_s
        )
