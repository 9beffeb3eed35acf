"""What σ and the drag can be while a vehicle stays within its limits: inputs of the bounds.

The theory lumps everything that A(s) and M(s) differ by, and all disturbances, into
``σ = M⁻¹ y1 - u``.  From the vehicle's limits, a wind and its rate of change follow

* the drag's Lipschitz constant L in the unit of u: the linear drag is in A(s), and the quadratic
  one, ``k2 |v - w| (v - w)`` as a vector, has the constant ``2 k2 max|v - w|``; over g it is one of
  u for x and y, over the gain of the thrust loop for z;
* a bound of |σ|, to be covered by the projection's bound Δ;
* Δ_d, a bound of |σ'|, for γ0.

These are bounds of the model: tilt answers as F does, speed, climb rate, tilt, wind and its rate of
change stay within what is stated, and r1 asks for no more than what moves M(s) at the vehicle's own
limits of speed and acceleration.  That last one is an assumption, and so Δ_d (and γ0 with it) is an
estimate of a bound; in flight σ' stays far below it.
"""

from dataclasses import dataclass

import numpy as np

from companion.config.models import DynamicsConfig, ResponseConfig, VehicleConfig
from companion.control.thrust import GRAVITY_M_S2
from companion.control.transfer_function import TransferFunction
from companion.theory.norms import of_rational
from companion.theory.plant import second_order


@dataclass(frozen=True, slots=True)
class Air:
    """What the air is taken to do."""

    wind_m_s: float = 4.5
    """Largest speed: 3.5 m/s with gusts of 1 m/s, and more than the shipped fan's jet of 4 m/s."""
    wind_change_m_s2: float = 12.0
    """How fast the wind on the vehicle changes: the edge of that jet (4 m/s falling off over
    0.4 m) crossed at 2 m/s."""


@dataclass(frozen=True, slots=True)
class ThrustLoop:
    """Of the companion's climb-rate loop, what the z axis needs."""

    proportional_1_s: float
    largest_acceleration_m_s2: float


@dataclass(frozen=True, slots=True)
class SigmaBounds:
    """Of one axis, in the unit of u."""

    lipschitz: float
    """L of the quadratic drag, per m/s."""
    sigma: float
    """Bound of |σ| within all limits, in the worst wind."""
    planned_sigma: float
    """Bound of |σ| of what M(s) needs for the vehicle's own limits of speed and acceleration."""
    sigma_rate: float
    """Δ_d: bound of |σ'|, 1/s."""
    r1_m_s: float
    """The bound of |r1| that it rests on."""


@dataclass(frozen=True, slots=True)
class _Inverse:
    """``M⁻¹ = q1 s + q0 + R(s)`` with ‖R‖."""

    q1_s: float
    q0: float
    rest: float


def horizontal_bounds(
    vehicle: VehicleConfig,
    dynamics: DynamicsConfig,
    air: Air,
    model: TransferFunction,
    low_pass: TransferFunction,
    delta: float,
) -> SigmaBounds:
    """Of x or y: u is the sine of the tilt.

    Args:
        vehicle: its limits.
        dynamics: its attitude response and drag.
        air: what the air does.
        model: M(s).
        low_pass: C(s).
        delta: the projection's bound of |σ̂|.
    """
    k1, k2 = dynamics.linear_drag_1_s, dynamics.quadratic_drag_1_m
    speed, sine = vehicle.speed_limit_m_s, float(np.sin(np.radians(vehicle.tilt_limit_deg)))
    relative = speed + air.wind_m_s
    overshoot, rate = _peaks(dynamics.attitude)
    inverse = _inverse(model)
    push = GRAVITY_M_S2 * overshoot * sine
    drag_most = k1 * relative + k2 * relative**2
    acceleration = push + drag_most
    # The largest |q0 y - q1 drag(y - w)|: drag and velocity partly cancel in still air.
    y = np.linspace(-speed, speed, 121)[:, None]
    against = y - np.linspace(-air.wind_m_s, air.wind_m_s, 121)[None, :]
    drag = k1 * against + k2 * np.abs(against) * against
    moved = float(np.abs(inverse.q0 * y - inverse.q1_s * drag).max())
    sigma = moved + inverse.rest * speed + inverse.q1_s * push + sine
    r1 = (inverse.q0 + inverse.rest) * speed + inverse.q1_s * vehicle.acceleration_limit_m_s2
    u_rate = _input_rate(low_pass, r1, delta, sine)
    tilt_rate = min(rate * sine, overshoot * u_rate)
    drag_slope = k1 + 2.0 * k2 * relative
    jerk = GRAVITY_M_S2 * tilt_rate + drag_slope * (acceleration + air.wind_change_m_s2)
    sigma_rate = inverse.q1_s * jerk + (inverse.q0 + inverse.rest) * acceleration + u_rate
    return SigmaBounds(2.0 * k2 * relative / GRAVITY_M_S2, sigma, r1 + sine, sigma_rate, r1)


def vertical_bounds(
    vehicle: VehicleConfig,
    dynamics: DynamicsConfig,
    air: Air,
    thrust: ThrustLoop,
    model: TransferFunction,
    low_pass: TransferFunction,
    delta: float,
) -> SigmaBounds:
    """Of z: u is a climb-rate command; a force per mass over the thrust loop's gain is one of u.

    Arguments as for `horizontal_bounds`, and the thrust loop below.
    """
    k1, k2 = dynamics.linear_drag_1_s, dynamics.quadratic_drag_1_m
    command = max(vehicle.climb_limit_m_s, vehicle.descent_limit_m_s)
    relative = command + air.wind_m_s
    fastest = vehicle.speed_limit_m_s + air.wind_m_s
    overshoot, rate = _peaks(dynamics.climb)
    inverse = _inverse(model)
    forced = (k1 * air.wind_m_s + k2 * relative**2) / thrust.proportional_1_s
    limited = thrust.largest_acceleration_m_s2 + k1 * relative + k2 * relative**2
    climb = overshoot * (command + forced)
    acceleration = min(rate * (command + forced), limited)
    sigma = (inverse.q0 + inverse.rest) * climb + inverse.q1_s * acceleration + command
    r1 = (inverse.q0 + inverse.rest) * command
    r1 += inverse.q1_s * thrust.largest_acceleration_m_s2
    u_rate = _input_rate(low_pass, r1, delta, command)
    slope = (k1 + 2.0 * k2 * relative) / thrust.proportional_1_s
    forced_rate = slope * (acceleration + air.wind_change_m_s2)
    climbing = second_order(dynamics.climb)
    direct = of_rational((*climbing.numerator, 0.0, 0.0), climbing.denominator)
    jerk = min(rate * (u_rate + forced_rate), direct * (command + forced))
    sigma_rate = inverse.q1_s * jerk + (inverse.q0 + inverse.rest) * acceleration + u_rate
    lipschitz = 2.0 * k2 * fastest / thrust.proportional_1_s
    return SigmaBounds(lipschitz, sigma, r1 + command, sigma_rate, r1)


def _peaks(response: ResponseConfig) -> tuple[float, float]:
    """‖F‖ and ‖s F‖: what a command of 1 can make of the answer and of its rate at most."""
    f = second_order(response)
    return (
        of_rational(f.numerator, f.denominator),
        of_rational((*f.numerator, 0.0), f.denominator),
    )


def _inverse(model: TransferFunction) -> _Inverse:
    quotient, remainder = np.polydiv(model.denominator, model.numerator)
    rest = 0.0
    if len(model.numerator) > 1:
        rest = of_rational(tuple(remainder.tolist()), model.numerator)
    return _Inverse(float(quotient[0]), float(quotient[1]), rest)


def _input_rate(low_pass: TransferFunction, r1: float, delta: float, largest_u: float) -> float:
    """Bound of |u'| for u = C(s) (r1 - σ̂)."""
    if low_pass.order == 1:  # u' = ω (r1 - σ̂ - u)
        omega = low_pass.denominator[1] / low_pass.denominator[0]
        return omega * (r1 + delta + largest_u)
    return of_rational((*low_pass.numerator, 0.0), low_pass.denominator) * (r1 + delta)
