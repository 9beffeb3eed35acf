"""A straight line through a gauge over time, and how sure its slope is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

CONFIDENCE = 0.95
FEWEST_BLOCKS = 4


@dataclass(frozen=True, slots=True)
class Trend:
    """A fitted line; its unit is the gauge's, and hours."""

    slope_per_h: float
    lower_per_h: float
    """The slope is above this with 95 % (one-sided)."""
    upper_per_h: float
    """The slope is below this with 95 % (one-sided)."""
    middle_h: float
    """Mean time of the blocks."""
    middle: float
    """The line's value then."""
    blocks: int

    def at(self, time_h: float) -> float:
        """The line's value at a time."""
        return self.middle + self.slope_per_h * (time_h - self.middle_h)


def trend_of(times_h: Sequence[float], values: Sequence[float], block: int) -> Trend:
    """Least squares through the means of consecutive blocks.

    Neighbouring samples are alike (an allocator's level stays for a while, a slow moment of the
    computer lasts), so single samples would pretend a certainty that is not there.  The means of
    blocks longer than that likeness are nearly independent: the slope's error follows from their
    scatter about the line, with Student's t for the few that they are.

    Args:
        times_h: of the samples, rising.
        values: as many.
        block: samples in a block; what is left over is left out at the beginning.

    Raises:
        ValueError: fewer than four blocks.
    """
    from scipy.stats import t as student

    blocks = len(values) // block
    if blocks < FEWEST_BLOCKS:
        raise ValueError(f"{len(values)} samples make {blocks} blocks; {FEWEST_BLOCKS} are needed")
    first = len(values) - blocks * block
    times = np.asarray(times_h[first:], dtype=float).reshape(blocks, block).mean(axis=1)
    means = np.asarray(values[first:], dtype=float).reshape(blocks, block).mean(axis=1)
    middle_h, middle = float(times.mean()), float(means.mean())
    away = times - middle_h
    spread = float(away @ away)
    slope = float(away @ (means - middle)) / spread
    residual = means - middle - slope * away
    error = float(np.sqrt(residual @ residual / (blocks - 2) / spread))
    margin = float(student.ppf(CONFIDENCE, blocks - 2)) * error
    return Trend(slope, slope - margin, slope + margin, middle_h, middle, blocks)
