"""Random numbers of many vehicles: each has its own, by its seed, whoever flies beside it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_BLOCK = 250


class Draws:
    """Standard normal numbers, a row of them for each vehicle at each step."""

    def __init__(self, seeds: Sequence[int], stream: int, count: int) -> None:
        """Begin.

        Args:
            seeds: one a vehicle.
            stream: keeps apart what the same vehicle draws for several ends.
            count: numbers a vehicle and step.
        """
        self._generators = [generator(seed, stream) for seed in seeds]
        self._block = np.empty((_BLOCK, count, len(seeds)), dtype=np.float32)
        self._step = _BLOCK

    def next(self) -> NDArray[np.float32]:
        """The next step's (count, vehicles)."""
        if self._step == _BLOCK:
            shape = self._block.shape[:2]
            for k, one in enumerate(self._generators):
                self._block[:, :, k] = one.standard_normal(shape, dtype=np.float32)
            self._step = 0
        self._step += 1
        step: NDArray[np.float32] = self._block[self._step - 1]
        return step


def generator(seed: int, stream: int) -> np.random.Generator:
    """A vehicle's generator for one end."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(stream,)))
