"""From a climb rate (the paper's u_z) to collective thrust.

A proportional-integral climb-rate loop gives a vertical acceleration; the estimated hover thrust
turns it into a force share; the tilt is compensated here, and nowhere else; the thrust curve turns
the force into the autopilot's thrust field.  The hover thrust is estimated on line by a scalar
Kalman filter on the vertical velocity: ``v_z' = g (f cos(tilt) / h - 1)``.
"""

import math
from dataclasses import dataclass

GRAVITY_M_S2 = 9.80665
_LEAST_COSINE = 0.5


@dataclass(frozen=True, slots=True)
class ThrustGains:
    """Gains, limits and the vehicle's thrust figures."""

    proportional: float
    """Climb-rate error to acceleration, 1/s."""
    integral: float
    """1/s²."""
    hover_thrust: float
    """First guess of the thrust field at hover, 0..1."""
    thrust_curve: float
    """c in ``force = c t² + (1 - c) t`` (as PX4's THR_MDL_FAC), 0..1."""
    minimum_thrust: float
    maximum_thrust: float
    maximum_acceleration_m_s2: float
    """Largest correction of the vertical acceleration, either way."""
    hover_drift: float
    """Standard deviation of the hover force share's random walk, 1/√s."""
    acceleration_noise_m_s2: float
    """Standard deviation of the vertical acceleration seen by the estimator, over one second."""


# Made at every tick, and frozen it takes several times as long to make: change none.
@dataclass(slots=True)
class ThrustMemory:
    """What the loop carries from sample to sample."""

    integral_m_s2: float
    hover_force: float
    """Estimated force share at hover, 0..1."""
    hover_variance: float
    vertical_force: float
    """Vertical component of the force share that was commanded last."""
    last_climb_rate_m_s: float
    saturated: bool


def force_from_thrust(thrust: float, curve: float) -> float:
    """Force share of a thrust field, both 0..1."""
    return curve * thrust * thrust + (1.0 - curve) * thrust


def thrust_from_force(force: float, curve: float) -> float:
    """Inverse of `force_from_thrust`."""
    if curve < 1e-9:
        return force
    b = 1.0 - curve
    return (-b + math.sqrt(b * b + 4.0 * curve * force)) / (2.0 * curve)


def start(
    gains: ThrustGains, climb_rate_m_s: float, hover_force: float | None = None
) -> ThrustMemory:
    """Memory at engagement: hovering at the given force share, or at the guessed thrust."""
    hover = hover_force or force_from_thrust(gains.hover_thrust, gains.thrust_curve)
    return ThrustMemory(0.0, hover, (0.1 * hover) ** 2, hover, climb_rate_m_s, False)


def step(
    gains: ThrustGains,
    memory: ThrustMemory,
    climb_rate_command_m_s: float,
    climb_rate_m_s: float,
    tilt_cosine: float,
    dt_s: float,
) -> tuple[ThrustMemory, float]:
    """Advance the loop by one sample.

    Args:
        gains: the gains.
        memory: from `start` or from the sample before.
        climb_rate_command_m_s: u_z, up positive.
        climb_rate_m_s: measured.
        tilt_cosine: of the attitude in effect; at least 0.5 is used.
        dt_s: time since the sample before, s.

    Returns:
        The new memory and the thrust field, 0..1.
    """
    estimated = _estimate_hover(gains, memory, climb_rate_m_s, dt_s)
    hover_force, hover_variance = estimated
    error = climb_rate_command_m_s - climb_rate_m_s
    integral = memory.integral_m_s2
    limit = gains.maximum_acceleration_m_s2
    acceleration = gains.proportional * error + integral
    if not memory.saturated and abs(acceleration) < limit:
        integral += gains.integral * error * dt_s
        integral = max(-limit, min(limit, integral))
    acceleration = max(-limit, min(limit, acceleration))
    force, missed = _force(gains, hover_force, acceleration, tilt_cosine)
    advanced = ThrustMemory(
        integral,
        hover_force,
        hover_variance,
        force * max(_LEAST_COSINE, tilt_cosine),
        climb_rate_m_s,
        missed != 0.0,
    )
    return advanced, thrust_from_force(force, gains.thrust_curve)


def accelerate(
    gains: ThrustGains,
    memory: ThrustMemory,
    acceleration_m_s2: float,
    climb_rate_m_s: float,
    tilt_cosine: float,
    dt_s: float,
) -> tuple[ThrustMemory, float, float]:
    """Advance by one sample for a controller that asks for vertical acceleration itself.

    Args:
        gains: the gains; those of the climb-rate loop are not used.
        memory: from `start` or from the sample before.
        acceleration_m_s2: wanted, up positive, beside what carries the weight.
        climb_rate_m_s: measured.
        tilt_cosine: of the attitude in effect; at least 0.5 is used.
        dt_s: time since the sample before, s.

    Returns:
        The new memory, the thrust field 0..1, and the acceleration that its limits leave.
    """
    hover_force, hover_variance = _estimate_hover(gains, memory, climb_rate_m_s, dt_s)
    force, missed = _force(gains, hover_force, acceleration_m_s2, tilt_cosine)
    advanced = ThrustMemory(
        memory.integral_m_s2,
        hover_force,
        hover_variance,
        force * max(_LEAST_COSINE, tilt_cosine),
        climb_rate_m_s,
        missed != 0.0,
    )
    lost = GRAVITY_M_S2 * missed * max(_LEAST_COSINE, tilt_cosine) / hover_force
    return advanced, thrust_from_force(force, gains.thrust_curve), acceleration_m_s2 - lost


def _force(
    gains: ThrustGains, hover_force: float, acceleration_m_s2: float, tilt_cosine: float
) -> tuple[float, float]:
    """Force share along the body for a vertical acceleration, and what the limits took of it."""
    wanted = (
        hover_force * (1.0 + acceleration_m_s2 / GRAVITY_M_S2) / max(_LEAST_COSINE, tilt_cosine)
    )
    if not math.isfinite(wanted):
        raise ValueError(f"the thrust that is wanted is not finite: {wanted}")
    curve = gains.thrust_curve
    low = force_from_thrust(gains.minimum_thrust, curve)
    high = force_from_thrust(gains.maximum_thrust, curve)
    force = max(low, min(high, wanted))
    return force, wanted - force


def _estimate_hover(
    gains: ThrustGains, memory: ThrustMemory, climb_rate_m_s: float, dt_s: float
) -> tuple[float, float]:
    """Hover force and its variance after a predict-and-update step of their filter.

    The measured acceleration over dt has the standard deviation that is given for one second,
    divided by the square root of dt.
    """
    hover = memory.hover_force
    variance = memory.hover_variance + gains.hover_drift**2 * dt_s
    ratio = memory.vertical_force / hover
    predicted = GRAVITY_M_S2 * (ratio - 1.0)
    measured = (climb_rate_m_s - memory.last_climb_rate_m_s) / dt_s
    slope = -GRAVITY_M_S2 * ratio / hover
    noise = gains.acceleration_noise_m_s2**2 / dt_s
    gain = variance * slope / (slope * slope * variance + noise)
    guess = force_from_thrust(gains.hover_thrust, gains.thrust_curve)
    updated = hover + gain * (measured - predicted)
    updated = max(0.5 * guess, min(1.5 * guess, updated))
    return updated, (1.0 - gain * slope) * variance
