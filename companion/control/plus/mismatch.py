"""What the identified plant gets wrong of the horizontal motion, learnt in flight.

The measured velocity's increments are compared with what the nominal plant makes of the measured
tilt.  What is left may be drag (``-κ v``), a tilt that pushes more or less than reckoned (``g a``),
and a heading that is off (``ε J a``, J a quarter turn): three numbers for both axes, by least
squares with exponential forgetting, about slow means (a steady wind is none of the three), and
with what was identified as the prior.  Each counts by the noise: a wandering estimate teaches
little.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from companion.control.reference_model import Array

Pair = tuple[float, float]
"""Of the horizontal axes."""

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

    def pushed(self, x: float, y: float) -> Pair:
        """What a reckoned acceleration, or its rate, is in truth."""
        g, e = 1.0 + self.gain, self.heading_rad
        return g * x - e * y, e * x + g * y

    def asked(self, x: float, y: float) -> Pair:
        """The inverse: what must be asked for to get an acceleration."""
        g, e = 1.0 + self.gain, self.heading_rad
        square = g * g + e * e
        return (g * x + e * y) / square, (g * y - e * x) / square

    def pushes(self, acceleration: Array) -> Array:
        """`pushed` of (2, …)."""
        return np.array(self.pushed(acceleration[0], acceleration[1]))

    def asks(self, acceleration: Array) -> Array:
        """`asked` of (2, …)."""
        return np.array(self.asked(acceleration[0], acceleration[1]))


NOTHING = Mismatch(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class MismatchMemory:
    """Sums of the least squares, and slow means.  Plain floats: for two axes they are quicker.

    A sample of the x axis has the regressors (-vx, ax, -ay), one of the y axis (-vy, ay, ax); so
    the information matrix over both is ``[[i, j, k], [j, l, 0], [k, 0, l]]``.
    """

    information: tuple[float, float, float, float]
    """(i, j, k, l)."""
    product: tuple[float, float, float]
    mean_left: Pair
    """m/s²."""
    mean_velocity: Pair
    mean_acceleration: Pair
    mean_sigma: Pair
    """m/s²."""
    variance: float
    """Of σ̂ about its mean, (m/s²)²."""


def start() -> MismatchMemory:
    """Nothing learnt yet."""
    nothing = (0.0, 0.0)
    return MismatchMemory(
        (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), nothing, nothing, nothing, nothing, 0.0
    )


def step(
    settings: MismatchSettings,
    memory: MismatchMemory,
    left_m_s2: Sequence[float] | Array,
    velocity_m_s: Sequence[float] | Array,
    acceleration_m_s2: Sequence[float] | Array,
    sigma_m_s2: Sequence[float] | Array,
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
    mean_left, (lx, ly) = _about_mean(memory.mean_left, left_m_s2, keep)
    mean_velocity, (vx, vy) = _about_mean(memory.mean_velocity, velocity_m_s, keep)
    mean_acceleration, (ax, ay) = _about_mean(memory.mean_acceleration, acceleration_m_s2, keep)
    mean_sigma, (gust_x, gust_y) = _about_mean(memory.mean_sigma, sigma_m_s2, keep)
    i, j, k, l_ = memory.information
    of_drag, of_gain, of_heading = memory.product
    return MismatchMemory(
        (
            keep * i + (vx * vx + vy * vy) * dt_s,
            keep * j - (vx * ax + vy * ay) * dt_s,
            keep * k + (vx * ay - vy * ax) * dt_s,
            keep * l_ + (ax * ax + ay * ay) * dt_s,
        ),
        (
            keep * of_drag - (vx * lx + vy * ly) * dt_s,
            keep * of_gain + (ax * lx + ay * ly) * dt_s,
            keep * of_heading + (ax * ly - ay * lx) * dt_s,
        ),
        mean_left,
        mean_velocity,
        mean_acceleration,
        mean_sigma,
        keep * memory.variance + (1.0 - keep) * 0.5 * (gust_x * gust_x + gust_y * gust_y),
    )


def _about_mean(mean: Pair, new: Sequence[float] | Array, keep: float) -> tuple[Pair, Pair]:
    """The slow mean with a new value, and that value about it."""
    x, y = float(new[0]), float(new[1])
    mean_x, mean_y = keep * mean[0] + (1.0 - keep) * x, keep * mean[1] + (1.0 - keep) * y
    return (mean_x, mean_y), (x - mean_x, y - mean_y)


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
    i, j, k, l_ = memory.information
    # With the prior on the diagonal; solved for κ first, which the other two know nothing else of.
    drag, gain, heading = (square / deviation**2 for deviation in deviations)
    gain, heading = l_ + gain, l_ + heading
    of_drag, of_gain, of_heading = memory.product
    kappa = (of_drag - j * of_gain / gain - k * of_heading / heading) / (
        i + drag - j * j / gain - k * k / heading
    )
    likely = (kappa, (of_gain - j * kappa) / gain, (of_heading - k * kappa) / heading)
    old = (before.drag_1_s, before.gain, before.heading_rad)
    share = 1.0 - math.exp(-dt_s / settings.settling_s)
    found = []
    for was, wanted, deviation in zip(old, likely, deviations, strict=True):
        limit = settings.farthest * deviation
        if abs(wanted) > limit:  # a NaN stays one
            wanted = math.copysign(limit, wanted)
        found.append(was + share * (wanted - was))
    return Mismatch(*found)
