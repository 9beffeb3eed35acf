"""Points of a space of parameters: every one of a grid, or evenly spread ones.

Each parameter is a function from the unit interval to its values; what is sampled is the unit cube.
Latin hypercube: McKay, Beckman & Conover (1979); Sobol's sequence, scrambled: Owen (1998), as
`scipy.stats.qmc` has them.
"""

import itertools
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.experiments.campaigns.models import Method, ParameterConfig, SampleConfig, Value

Point = tuple[Value, ...]
"""A value for each parameter, in their order."""


@dataclass(frozen=True, slots=True)
class Axis:
    """A parameter's values."""

    choices: tuple[Value, ...] | None
    """None: a range."""
    low: float = 0.0
    high: float = 1.0
    log: bool = False
    integer: bool = False
    steps: int | None = None

    @classmethod
    def of(cls, config: ParameterConfig) -> "Axis":
        """What a file says of a parameter."""
        if config.values is not None:
            return cls(config.values)
        assert config.low is not None
        assert config.high is not None
        return cls(None, config.low, config.high, config.log, config.integer, config.steps)

    def at(self, share: float) -> Value:
        """The value at a share of the axis in [0, 1): equal shares for choices and whole numbers.

        Args:
            share: evenly spread over [0, 1) it gives evenly spread values.
        """
        if self.choices is not None:
            return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]
        if self.integer:
            return int(self.low) + int(share * (self.high - self.low + 1.0))
        return self._between(share)

    def grid(self) -> tuple[Value, ...]:
        """The values that a grid takes; the ends of a range are among them."""
        if self.choices is not None:
            return self.choices
        assert self.steps is not None
        last = self.steps - 1
        values = [self._between(k / last) for k in range(self.steps)]
        if self.integer:
            return tuple(dict.fromkeys(round(value) for value in values))
        return tuple(values)

    def _between(self, share: float) -> float:
        if share == 1.0:
            return self.high
        if self.log:
            low, high = math.log(self.low), math.log(self.high)
            return min(self.high, max(self.low, math.exp(low + share * (high - low))))
        return self.low + share * (self.high - self.low)


def sample(config: SampleConfig, axes: Sequence[Axis]) -> list[Point]:
    """The points, in an order that the configuration alone decides.

    Args:
        config: how they are taken.
        axes: of the parameters; the ranges of a grid have steps.
    """
    if config.method == "grid":
        return list(itertools.product(*(axis.grid() for axis in axes)))
    assert config.points is not None
    shares = _unit_sample(config.method, len(axes), config.points, config.seed)
    return [
        tuple(axis.at(share) for axis, share in zip(axes, row, strict=True))
        for row in shares.tolist()
    ]


def remark(config: SampleConfig) -> str | None:
    """What a person should know of a sample before it is flown; None: nothing."""
    points = config.points
    if config.method != "sobol" or points is None or points & (points - 1) == 0:
        return None
    below = 1 << (points.bit_length() - 1)
    return (
        f"a Sobol sample is balanced for powers of two alone, and {points} points are none. Fly "
        f"{below} or {2 * below}, or take latin-hypercube, which is even for any number."
    )


def _unit_sample(method: Method, dimension: int, points: int, seed: int) -> NDArray[np.float64]:
    """Points of the unit cube [0, 1)^dimension, (points, dimension)."""
    from scipy.stats import qmc

    generator = np.random.default_rng(seed)
    spread = qmc.LatinHypercube if method == "latin-hypercube" else qmc.Sobol
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of Sobol's: `remark` says it, with a remedy
        made: NDArray[np.float64] = spread(dimension, seed=generator).random(points)
    return made
