"""The linear plant of one axis, A(s), as the theory reckons with it.

The paper (Pereida & Schoellig 2018, eq. `Asystem`) has ``y1(s) = A(s) (u(s) + d(s))`` per axis,
with y1 the velocity.  For x and y, u is the sine of the tilt:
``A(s) = g F_attitude(s) e^{-sτ} / (s + k1)``; for z it is a climb-rate command:
``A(s) = F_climb(s) e^{-sτ}``.  F is of second order and gain 1, τ is the transport delay of the
loop and the vehicle's own dead time together.  The linear drag k1 is part of A(s), so that only the
quadratic one is left for the Lipschitz constant L of d.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.config.models import DynamicsConfig, ResponseConfig
from companion.control.reference_model import Array
from companion.control.thrust import GRAVITY_M_S2
from companion.control.transfer_function import TransferFunction

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class AxisPlant:
    """A(s): a rational part behind a delay."""

    rational: TransferFunction
    delay_s: float

    def __post_init__(self) -> None:
        """Refuse what the stability tests are not made for.

        Raises:
            ValueError: a pole in the right half plane, more than one at 0, or a negative delay.
        """
        poles = np.roots(self.rational.denominator)
        if (poles.real > 1e-9).any() or self.integrators > 1 or self.delay_s < 0.0:
            raise ValueError("A(s) must be stable, but for at most one integrator, and causal")

    @property
    def integrators(self) -> int:
        """Number of poles at s = 0."""
        return int(np.sum(np.abs(np.roots(self.rational.denominator)) < 1e-9))

    def at(self, s: ComplexArray) -> ComplexArray:
        """A(s) with its exact delay."""
        return evaluate(self.rational, s) * np.exp(-s * self.delay_s)


def evaluate(function: TransferFunction, s: ComplexArray) -> ComplexArray:
    """Value of a transfer function at complex frequencies s, rad/s."""
    value: ComplexArray = np.polyval(function.numerator, s) / np.polyval(function.denominator, s)
    return value


def imaginary(omega_rad_s: Array) -> ComplexArray:
    """``s = jω``."""
    return np.asarray(1j * omega_rad_s, dtype=np.complex128)


def second_order(response: ResponseConfig) -> TransferFunction:
    """``ωn² / (s² + 2 ζ ωn s + ωn²)``, without the dead time."""
    omega, zeta = response.natural_frequency_rad_s, response.damping
    return TransferFunction((omega * omega,), (1.0, 2.0 * zeta * omega, omega * omega))


def axis_plants(dynamics: DynamicsConfig) -> tuple[AxisPlant, AxisPlant, AxisPlant]:
    """A(s) of x, y and z of a vehicle."""
    attitude = second_order(dynamics.attitude)
    horizontal = AxisPlant(
        TransferFunction(
            tuple(GRAVITY_M_S2 * value for value in attitude.numerator),
            tuple(np.polymul(attitude.denominator, (1.0, dynamics.linear_drag_1_s)).tolist()),
        ),
        dynamics.loop_delay_s + dynamics.attitude.delay_s,
    )
    vertical = AxisPlant(
        second_order(dynamics.climb), dynamics.loop_delay_s + dynamics.climb.delay_s
    )
    return horizontal, horizontal, vertical
