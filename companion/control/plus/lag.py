"""The attitude's lag as it is in flight, against the identified one.

The measured tilt is compared with what the identified response makes of the commands: a vehicle
that lags by δ more answers with ``a(t - δ) ≈ a(t) - δ a'(t)``, so that δ is the slope of the
difference against -a'.  Least squares with exponential forgetting, over both horizontal axes,
drawn to 0 by a prior: without excitation nothing is learnt.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from companion.control.reference_model import Array


@dataclass(frozen=True, slots=True)
class LagSettings:
    """How quickly the lag is learnt, and how far it may go."""

    forgetting_s: float = 4.0
    prior: float = 1.0
    """(m/s³)² s of excitation that weighs as much as what was identified before the flight."""
    least_scale: float = 0.6
    greatest_scale: float = 2.2
    """Of the time constants of the attitude's response."""


@dataclass(frozen=True, slots=True)
class LagMemory:
    """Sums of the least squares, and slow means which are taken off first."""

    information: float
    product: float
    mean_error: tuple[float, float]
    mean_rate: tuple[float, float]


def start() -> LagMemory:
    """Nothing learnt yet."""
    return LagMemory(0.0, 0.0, (0.0, 0.0), (0.0, 0.0))


def step(
    settings: LagSettings,
    memory: LagMemory,
    measured_m_s2: Sequence[float] | Array,
    modelled_m_s2: Sequence[float] | Array,
    modelled_rate_m_s3: Sequence[float] | Array,
    dt_s: float,
) -> LagMemory:
    """Take a sample of both horizontal axes in.

    Args:
        settings: of the law.
        memory: of the sample before.
        measured_m_s2: (2,) acceleration by the measured tilt.
        modelled_m_s2: (2,) the same by the identified response to the commands.
        modelled_rate_m_s3: (2,) its rate.
        dt_s: since the sample before.
    """
    keep = math.exp(-dt_s / settings.forgetting_s)
    information, product = keep * memory.information, keep * memory.product
    mean_error, mean_rate = [], []
    for axis in range(2):
        error = float(measured_m_s2[axis]) - float(modelled_m_s2[axis])
        rate = float(modelled_rate_m_s3[axis])
        mean_error.append(keep * memory.mean_error[axis] + (1.0 - keep) * error)
        mean_rate.append(keep * memory.mean_rate[axis] + (1.0 - keep) * rate)
        error, rate = error - mean_error[axis], rate - mean_rate[axis]
        information += rate * rate * dt_s
        product -= rate * error * dt_s
    (ex, ey), (rx, ry) = mean_error, mean_rate
    return LagMemory(information, product, (ex, ey), (rx, ry))


def extra_lag_s(settings: LagSettings, memory: LagMemory) -> float:
    """δ, s: by how much the attitude lags more than was identified."""
    return memory.product / (memory.information + settings.prior)


def scale(settings: LagSettings, memory: LagMemory, identified_lag_s: float) -> float:
    """Factor on the identified time constants that makes up the learnt lag."""
    wanted = 1.0 + extra_lag_s(settings, memory) / identified_lag_s
    return max(settings.least_scale, min(settings.greatest_scale, wanted))
