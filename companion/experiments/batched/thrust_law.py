"""`companion.control.thrust` over many vehicles: the same lines, with arrays."""

import numpy as np

from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2, ThrustGains, force_from_thrust

_LEAST_COSINE = 0.5


class ThrustLaw:
    """From climb rates to thrust fields, (vehicles,) each; it keeps its memory itself."""

    def __init__(self, gains: ThrustGains, climb_rate_m_s: Array) -> None:
        """Begin hovering at the guessed thrust."""
        count = len(climb_rate_m_s)
        curve = gains.thrust_curve
        self._gains = gains
        self._guess = force_from_thrust(gains.hover_thrust, curve)
        self._low = force_from_thrust(gains.minimum_thrust, curve)
        self._high = force_from_thrust(gains.maximum_thrust, curve)
        self._integral = np.zeros(count)
        self.hover_force = np.full(count, self._guess)
        """Estimated."""
        self._variance = np.full(count, (0.1 * self._guess) ** 2)
        self._vertical = self.hover_force.copy()
        self._last = climb_rate_m_s.copy()
        self._saturated = np.zeros(count, dtype=bool)

    def step(
        self, command_m_s: Array, climb_rate_m_s: Array, tilt_cosine: Array, dt_s: float
    ) -> Array:
        """The thrust fields; arguments as for `companion.control.thrust.step`."""
        gains, limit = self._gains, self._gains.maximum_acceleration_m_s2
        self._estimate(climb_rate_m_s, dt_s)
        error = command_m_s - climb_rate_m_s
        wanted = gains.proportional * error + self._integral
        free = ~self._saturated & (np.abs(wanted) < limit)
        moved = np.clip(self._integral + gains.integral * error * dt_s, -limit, limit)
        self._integral = np.where(free, moved, self._integral)
        acceleration = np.clip(wanted, -limit, limit)
        cosine = np.maximum(_LEAST_COSINE, tilt_cosine)
        asked = self.hover_force * (1.0 + acceleration / GRAVITY_M_S2) / cosine
        force = np.clip(asked, self._low, self._high)
        self._vertical = force * cosine
        self._last = climb_rate_m_s
        self._saturated = asked != force
        curve = gains.thrust_curve
        if curve < 1e-9:
            return force
        linear = 1.0 - curve
        field: Array = (np.sqrt(linear**2 + 4.0 * curve * force) - linear) / (2.0 * curve)
        return field

    def _estimate(self, climb_rate_m_s: Array, dt_s: float) -> None:
        gains, hover = self._gains, self.hover_force
        variance = self._variance + gains.hover_drift**2 * dt_s
        ratio = self._vertical / hover
        measured = (climb_rate_m_s - self._last) / dt_s
        slope = -GRAVITY_M_S2 * ratio / hover
        gain = (
            variance * slope / (slope * slope * variance + gains.acceleration_noise_m_s2**2 / dt_s)
        )
        moved = hover + gain * (measured - GRAVITY_M_S2 * (ratio - 1.0))
        self.hover_force = np.clip(moved, 0.5 * self._guess, 1.5 * self._guess)
        self._variance = (1.0 - gain * slope) * variance
