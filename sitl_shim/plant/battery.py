"""The battery: charge drawn, voltage under load, and what the motors make of it."""

from sitl_shim.plant.vehicle import Battery

_SECONDS_PER_HOUR = 3600.0


class BatteryPack:
    """One battery, full at first."""

    __slots__ = ("_model", "remaining", "voltage_v")

    def __init__(self, model: Battery) -> None:
        self._model = model
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
        """Draw the power of the avionics and of the motors for one step.

        Shaft power goes with the cube of a rotor's speed, and the signal stands for the speed.
        """
        model = self._model
        a, b, c, d = signals
        power_w = model.idle_power_w + 0.25 * model.full_power_w * (
            a * a * a + b * b * b + c * c * c + d * d * d
        )
        current_a = power_w / self.voltage_v
        drawn = current_a * step_s / (_SECONDS_PER_HOUR * model.capacity_a_h)
        self.remaining = max(0.0, self.remaining - drawn)
        open_v = model.empty_voltage_v + self.remaining * (
            model.full_voltage_v - model.empty_voltage_v
        )
        # Never below half: the current above is a power over a voltage.
        self.voltage_v = max(open_v - current_a * model.resistance_ohm, 0.5 * model.empty_voltage_v)
