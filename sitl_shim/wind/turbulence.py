"""Random processes in time, as turbulence needs them: exact on a fixed grid, by seed.

Each runs on its own grid and is interpolated between, so that what it gives depends on seed
and time alone, not on who asks how often.
"""

from math import exp, sqrt

import numpy as np

_BLOCK = 1024
GRID_S = 0.004


class FirstOrderNoise:
    """Three independent Gauss-Markov processes of unit variance and one correlation time.

    Autocorrelation exp(-|t| / T): the first-order shaping filter 1 / (1 + T s).
    """

    __slots__ = ("_decay", "_generator", "_index", "_last", "_next", "_noise", "_time_next_s")

    def __init__(self, correlation_time_s: float, generator: np.random.Generator) -> None:
        self._decay = exp(-GRID_S / correlation_time_s)
        self._generator = generator
        self._noise: list[tuple[float, float, float]] = []
        self._index = 0
        self._last = self._draw()
        self._time_next_s = 0.0
        self._next = self._last
        self._advance()

    def at(self, time_s: float) -> tuple[float, float, float]:
        """The three values at a time that is not before the last one asked for.

        Raises:
            ValueError: time ran back past what is still known.
        """
        while time_s > self._time_next_s:
            self._advance()
        share = 1.0 - (self._time_next_s - time_s) / GRID_S
        if share < -1e-6:
            raise ValueError(f"turbulence cannot go back to {time_s} s")
        (a, b, c), (d, e, f) = self._last, self._next
        return (a + share * (d - a), b + share * (e - b), c + share * (f - c))

    def _advance(self) -> None:
        decay = self._decay
        kick = sqrt(1.0 - decay * decay)
        a, b, c = self._last = self._next
        e, f, g = self._draw()
        self._next = (decay * a + kick * e, decay * b + kick * f, decay * c + kick * g)
        self._time_next_s += GRID_S

    def _draw(self) -> tuple[float, float, float]:
        if self._index >= len(self._noise):
            block = self._generator.standard_normal((_BLOCK, 3)).tolist()
            self._noise = [(a, b, c) for a, b, c in block]
            self._index = 0
        self._index += 1
        return self._noise[self._index - 1]
