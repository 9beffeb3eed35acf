"""What the identified plant gets wrong of the horizontal motion, learnt in flight.

The measured velocity's increments are compared with what the nominal plant makes of the measured
tilt.  What is left may be drag (``-κ v``), a tilt that pushes more or less than reckoned (``g a``),
and a heading that is off (``ε J a``, J a quarter turn): three numbers for both axes, by least
squares with exponential forgetting, about slow means (a steady wind is none of the three), and
with what was identified as the prior.  Each counts by the noise: a wandering estimate teaches
little.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.control.reference_model import Array

_GUST_S = 2.0
"""Time over which gusts are alike: variance to density."""


@dataclass(frozen=True, slots=True)
class MismatchSettings:
    """How quickly is learnt, and how far it may go."""

    forgetting_s: float = 8.0
    drag_1_s: float = 0.2
    """Standard deviation of κ before anything is learnt."""
    gain: float = 0.1
    """Of g."""
    heading_rad: float = 0.15
    """Of ε."""
    settling_s: float = 0.5
    """Of the low-pass on what was learnt: the noise of single samples stays out of the command."""
    farthest: float = 3.0
    """Standard deviations that each may go."""


@dataclass(frozen=True, slots=True)
class Mismatch:
    """What was learnt."""

    drag_1_s: float
    """κ, beside the identified drag."""
    gain: float
    """g."""
    heading_rad: float
    """ε."""

    def pushes(self, acceleration: Array) -> Array:
        """(2, …) what a reckoned acceleration, or its rate, is in truth."""
        x, y = acceleration[0], acceleration[1]
        g, e = 1.0 + self.gain, self.heading_rad
        return np.array([g * x - e * y, e * x + g * y])

    def asks(self, acceleration: Array) -> Array:
        """(2, …) the inverse: what must be asked for to get an acceleration."""
        x, y = acceleration[0], acceleration[1]
        g, e = 1.0 + self.gain, self.heading_rad
        return np.array([g * x + e * y, -e * x + g * y]) / (g * g + e * e)


NOTHING = Mismatch(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class MismatchMemory:
    """Sums of the least squares, and slow means."""

    information: Array
    """(3, 3)."""
    product: Array
    """(3,)."""
    mean_left: Array
    """(2,) m/s²."""
    mean_regressors: Array
    """(2, 3)."""
    mean_sigma: Array
    """(2,) m/s²."""
    variance: float
    """Of σ̂ about its mean, (m/s²)²."""


def start() -> MismatchMemory:
    """Nothing learnt yet."""
    return MismatchMemory(
        np.zeros((3, 3)), np.zeros(3), np.zeros(2), np.zeros((2, 3)), np.zeros(2), 0.0
    )


def step(
    settings: MismatchSettings,
    memory: MismatchMemory,
    left_m_s2: Array,
    velocity_m_s: Array,
    acceleration_m_s2: Array,
    sigma_m_s2: Array,
    dt_s: float,
) -> MismatchMemory:
    """Take a sample of both horizontal axes in.

    Args:
        settings: of the law.
        memory: of the sample before.
        left_m_s2: (2,) increment of the measured velocity over dt, less what the identified plant
            makes of the measured tilt.
        velocity_m_s: (2,).
        acceleration_m_s2: (2,) by the measured tilt, as identified.
        sigma_m_s2: (2,) what is unexplained even by what was learnt: of gusts.
        dt_s: since the sample before.
    """
    keep = math.exp(-dt_s / settings.forgetting_s)
    ax, ay = acceleration_m_s2
    regressors = np.array([[-velocity_m_s[0], ax, -ay], [-velocity_m_s[1], ay, ax]])
    mean_left = keep * memory.mean_left + (1.0 - keep) * left_m_s2
    mean_regressors = keep * memory.mean_regressors + (1.0 - keep) * regressors
    mean_sigma = keep * memory.mean_sigma + (1.0 - keep) * sigma_m_s2
    gust = sigma_m_s2 - mean_sigma
    r = regressors - mean_regressors
    return MismatchMemory(
        keep * memory.information + r.T @ r * dt_s,
        keep * memory.product + r.T @ (left_m_s2 - mean_left) * dt_s,
        mean_left,
        mean_regressors,
        mean_sigma,
        keep * memory.variance + (1.0 - keep) * 0.5 * float(gust @ gust),
    )


def learnt(
    settings: MismatchSettings,
    memory: MismatchMemory,
    before: Mismatch,
    density: float,
    dt_s: float,
) -> Mismatch:
    """The most likely numbers, low-passed.

    Args:
        settings: of the law.
        memory: of the last sample.
        before: what was learnt up to the sample before.
        density: of the unexplained acceleration, m/s² per √Hz.
        dt_s: since the sample before.
    """
    deviations = (settings.drag_1_s, settings.gain, settings.heading_rad)
    square = density**2 + memory.variance * _GUST_S
    information = memory.information.copy()
    for i, deviation in enumerate(deviations):
        information[i, i] += square / deviation**2
    likely = np.linalg.solve(information, memory.product).tolist()
    old = (before.drag_1_s, before.gain, before.heading_rad)
    share = 1.0 - math.exp(-dt_s / settings.settling_s)
    found = []
    for was, wanted, deviation in zip(old, likely, deviations, strict=True):
        limit = settings.farthest * deviation
        if abs(wanted) > limit:  # a NaN stays one
            wanted = math.copysign(limit, wanted)
        found.append(was + share * (wanted - was))
    return Mismatch(*found)
