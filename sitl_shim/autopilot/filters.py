"""Digital low-pass filters of one value, stepped at a fixed rate."""

import math


class SecondOrderLowPass:
    """Butterworth low-pass of second order (bilinear transform), as PX4's LowPassFilter2p.

    Args:
        sample_rate_hz: rate of the calls of `step`.
        cutoff_hz: -3 dB frequency; 0, or from half the sample rate on, switches the filter off.
    """

    __slots__ = ("_a1", "_a2", "_b0", "_b1", "_b2", "_on", "_started", "_w1", "_w2")

    def __init__(self, sample_rate_hz: float, cutoff_hz: float) -> None:
        self._on = 0.0 < cutoff_hz < sample_rate_hz / 2.0
        self._started = False
        self._w1 = self._w2 = 0.0
        self._a1 = self._a2 = self._b1 = self._b2 = 0.0
        self._b0 = 1.0
        if self._on:
            ohm = math.tan(math.pi * cutoff_hz / sample_rate_hz)
            scale = 1.0 + 2.0 * math.cos(math.pi / 4.0) * ohm + ohm * ohm
            self._b0 = ohm * ohm / scale
            self._b1 = 2.0 * self._b0
            self._b2 = self._b0
            self._a1 = 2.0 * (ohm * ohm - 1.0) / scale
            self._a2 = (1.0 - 2.0 * math.cos(math.pi / 4.0) * ohm + ohm * ohm) / scale

    @property
    def coefficients(self) -> tuple[float, float, float, float, float, float]:
        """1 if it filters or 0, b0, b1, b2, a1, a2."""
        return (float(self._on), self._b0, self._b1, self._b2, self._a1, self._a2)

    def settled_on(self, value: float) -> float:
        """Both of its memories where it has always been given this value."""
        return value / (1.0 + self._a1 + self._a2)

    def step(self, value: float) -> float:
        """Take one sample and return the filtered value; starts settled on the first."""
        if not self._on:
            return value
        if not self._started:
            self._started = True
            self._w1 = self._w2 = self.settled_on(value)
        w0 = value - self._a1 * self._w1 - self._a2 * self._w2
        result = self._b0 * w0 + self._b1 * self._w1 + self._b2 * self._w2
        self._w2 = self._w1
        self._w1 = w0
        return result


def first_order_gain(sample_rate_hz: float, cutoff_hz: float) -> float:
    """Gain a of y += a (x - y) for a first-order low-pass, as PX4's AlphaFilter; 1 is "off"."""
    if not 0.0 < cutoff_hz < sample_rate_hz:
        return 1.0
    time_constant_s = 1.0 / (2.0 * math.pi * cutoff_hz)
    step_s = 1.0 / sample_rate_hz
    return step_s / (time_constant_s + step_s)
