"""A PID law per axis, with the derivative of the measurement.

One law in three places: outside, ``r2 = y2* + PID(y2* - y2)`` over the L1 controller (PID-L1, and
LQR-L1 with the gains of `companion.control.lqr`); inside, ``u = PID(r2 - y2)`` below the MPC
(MPC-PID).  With zero gains outside, r2 = y2*: the framework ``l1``.

The derivative acts on the measured velocity.  That of the error would contain ẏ2*, and ``y2* + T
ẏ2*`` is a preview of y2* by T to first order: what these baselines must not have.  The outer
controller can be told to take it all the same (`companion.control.feedback`), to see what it makes.
"""

from dataclasses import dataclass

import numpy as np

from companion.control.reference_model import Array


@dataclass(frozen=True, slots=True)
class PidGains:
    """Gains per axis; tuples of equal length."""

    kp: tuple[float, ...]
    """Unit of the output per m."""
    ki: tuple[float, ...]
    """Unit of the output per m s."""
    kd: tuple[float, ...]
    """Unit of the output per m/s."""
    integral_limit: tuple[float, ...]
    """Bound of the integral's part of the output."""


@dataclass(frozen=True, slots=True)
class PidMemory:
    """What the law carries from step to step; each array is (axes,)."""

    integral: Array
    """The integral's part of the output."""
    held_integral: Array
    """The same before the last step: where it stays if the output was cut."""
    output: Array
    """Of the last step."""


@dataclass(frozen=True, slots=True)
class PidTerms:
    """What the output is made of; each array is (axes,)."""

    proportional: Array
    integral: Array
    derivative: Array


def start(integral: Array) -> PidMemory:
    """Memory that begins with an integral's part of the output, (axes,)."""
    held = np.array(integral, dtype=float)
    return PidMemory(held, held, held)


def step(
    gains: PidGains, memory: PidMemory, error_m: Array, velocity_m_s: Array, dt_s: float
) -> tuple[PidMemory, Array, PidTerms]:
    """Advance by one sample.

    Args:
        gains: the gains.
        memory: from `start` or from the sample before.
        error_m: (axes,) reference minus measured position.
        velocity_m_s: (axes,) rate whose negative is the derivative: the measured velocity, or
            minus the rate of the error.
        dt_s: time since the sample before.

    Returns:
        The new memory, the output (axes,), and its parts.
    """
    # What it began with may lie beyond the limit: it comes back from there, and goes no further.
    limit = np.maximum(gains.integral_limit, np.abs(memory.integral))
    integral = np.clip(memory.integral + np.asarray(gains.ki) * error_m * dt_s, -limit, limit)
    terms = PidTerms(np.asarray(gains.kp) * error_m, integral, -np.asarray(gains.kd) * velocity_m_s)
    output = terms.proportional + terms.integral + terms.derivative
    return PidMemory(integral, memory.integral, output), output, terms


def with_applied(memory: PidMemory, applied: Array) -> PidMemory:
    """Hold the integral of the axes on which it moves further past what a limit has cut off."""
    if applied is memory.output:
        return memory
    cut = memory.output - applied
    winding = cut * (memory.integral - memory.held_integral) > 0.0
    integral = np.where(winding, memory.held_integral, memory.integral)
    return PidMemory(integral, memory.held_integral, memory.output)
