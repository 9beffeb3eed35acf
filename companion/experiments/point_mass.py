"""A vehicle simple enough to be planned with and simulated by one and the same lines."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from companion.control.thrust import GRAVITY_M_S2

STATES = 10
"""Position (3, ENU m), velocity (3, ENU m/s), roll and pitch (FLU rad), their rates (rad/s)."""
INPUTS = 3
"""Roll and pitch setpoint (rad), collective thrust per mass (m/s²)."""
HOVER = (0.0, 0.0, GRAVITY_M_S2)
"""The input that holds a vehicle still."""

_SMOOTH_SPEED2 = 1e-6
"""m²/s²: keeps the derivative of |v| finite at rest."""


@dataclass(frozen=True, slots=True)
class PointMass:
    """A vehicle as a point mass under a thrust whose direction follows a setpoint with a lag."""

    attitude_frequency_rad_s: float = 12.0
    attitude_damping: float = 0.8
    linear_drag_1_s: float = 0.15
    quadratic_drag_1_m: float = 0.02

    def derivative(self, lib: Any, state: Any, inputs: Any) -> list[Any]:  # noqa: ANN401
        """Time derivative of the state at yaw 0, as `STATES` entries.

        Args:
            lib: the module of the functions: `math` for floats, `casadi` for symbols.
            state: as in `STATES`.
            inputs: as in `INPUTS`.
        """
        vx, vy, vz, roll, pitch, roll_rate, pitch_rate = (state[i] for i in range(3, STATES))
        thrust = inputs[2]
        speed = lib.sqrt(vx * vx + vy * vy + vz * vz + _SMOOTH_SPEED2)
        drag = self.linear_drag_1_s + self.quadratic_drag_1_m * speed
        level = thrust * lib.cos(roll)
        stiffness = self.attitude_frequency_rad_s**2
        friction = 2.0 * self.attitude_damping * self.attitude_frequency_rad_s
        return [
            vx,
            vy,
            vz,
            level * lib.sin(pitch) - drag * vx,
            -thrust * lib.sin(roll) - drag * vy,
            level * lib.cos(pitch) - GRAVITY_M_S2 - drag * vz,
            roll_rate,
            pitch_rate,
            stiffness * (inputs[0] - roll) - friction * roll_rate,
            stiffness * (inputs[1] - pitch) - friction * pitch_rate,
        ]

    def rk4(self, lib: Any, state: Any, inputs: Any, step_s: float) -> list[Any]:  # noqa: ANN401
        """The state one Runge-Kutta step later; arguments as for `derivative`."""

        def ahead(slope: Sequence[Any], time_s: float) -> list[Any]:
            return [state[i] + time_s * slope[i] for i in range(STATES)]

        k1 = self.derivative(lib, state, inputs)
        k2 = self.derivative(lib, ahead(k1, step_s / 2.0), inputs)
        k3 = self.derivative(lib, ahead(k2, step_s / 2.0), inputs)
        k4 = self.derivative(lib, ahead(k3, step_s), inputs)
        mean = [(k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0 for i in range(STATES)]
        return ahead(mean, step_s)
