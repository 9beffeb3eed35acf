"""What the battery says of itself, which need not be so."""

from sitl_shim.autopilot.interface import BatteryReport
from sitl_shim.plant.state import PlantState
from sitl_shim.plant.vehicle import Battery


class BatteryFault:
    """A battery that reports another share of its charge than it has, from a moment on.

    The motors turn as before; the report goes on falling as the battery is drawn from.

    Args:
        model: of the battery.
    """

    __slots__ = ("_error", "_model")

    def __init__(self, model: Battery) -> None:
        self._model = model
        self._error = 0.0

    def report(self, remaining: float, state: PlantState) -> None:
        """Say from now on that so much is left (0 to 1)."""
        self._error = remaining - state.battery_remaining

    def of(self, state: PlantState) -> BatteryReport:
        """What is reported: the voltage is that of a battery so full, under the present load."""
        remaining = max(0.0, min(1.0, state.battery_remaining + self._error))
        slope_v = self._model.full_voltage_v - self._model.empty_voltage_v
        voltage_v = state.battery_voltage_v + self._error * slope_v
        return BatteryReport(remaining, max(0.0, voltage_v))
