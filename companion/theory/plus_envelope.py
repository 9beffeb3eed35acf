"""What σ of MPC-L1+ can be while a vehicle stays within its limits.

Its predictor knows the linear drag against the ground; σ is what is left: the wind's part of it,
the quadratic drag, and the change of either.  Bounds of the model, as those of `envelope.py`:
speed, climb rate, tilt, wind and its rate of change stay within what is stated.
"""

import math
from dataclasses import dataclass

from companion.config.models import DynamicsConfig, VehicleConfig
from companion.control.thrust import GRAVITY_M_S2
from companion.theory.envelope import Air


@dataclass(frozen=True, slots=True)
class PlusSigma:
    """Of one axis."""

    planned_m_s2: float
    """Bound of |σ| at the vehicle's own speeds in still air."""
    worst_m_s2: float
    """The same in the worst wind."""
    rate_m_s3: float
    """Bound of |σ'|."""
    lipschitz_1_s: float
    """L of the quadratic drag: m/s² per m/s."""


def sigma_bounds(
    vehicle: VehicleConfig, dynamics: DynamicsConfig, air: Air, *, vertical: bool
) -> PlusSigma:
    """Of a horizontal axis, or of the vertical one.

    Args:
        vehicle: its limits.
        dynamics: its drag.
        air: what the air does.
        vertical: of z.
    """
    k1, k2 = dynamics.linear_drag_1_s, dynamics.quadratic_drag_1_m
    speed, wind = vehicle.speed_limit_m_s, air.wind_m_s
    along = max(vehicle.climb_limit_m_s, vehicle.descent_limit_m_s) if vertical else speed
    relative = speed + wind
    worst = k1 * wind + k2 * relative * (along + wind)
    push = GRAVITY_M_S2 * dynamics.tilt_gain * math.tan(math.radians(vehicle.tilt_limit_deg))
    acceleration = push + k1 * speed + worst
    lipschitz = 2.0 * k2 * relative
    rate = k1 * air.wind_change_m_s2 + lipschitz * (acceleration + air.wind_change_m_s2)
    return PlusSigma(k2 * speed * along, worst, rate, lipschitz)
