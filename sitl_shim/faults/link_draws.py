"""What is drawn for one fault of a link: a stream of numbers of its own for each thing it does.

So whether a datagram is lost says nothing of whether it would have been changed, and another share
of losses leaves it as it is which of the rest arrive twice.
"""

from enum import IntEnum
from math import inf

import numpy as np

from sitl_shim.faults.schema import Bursts

_SEED_STREAM = 7
"""Beside those of plant, wind, estimator, commander, links and cameras."""
_AT_ONCE = 1024


class Of(IntEnum):
    """What a stream of numbers decides."""

    LOSS = 0
    BURSTS = 1
    CORRUPTION = 2
    CHANGES = 3
    DUPLICATION = 4
    JITTER = 5
    REORDERING = 6
    EXTRA_JITTER = 7
    """Of second copies and of babble, so that these take no number of any other datagram's."""


class Draws:
    """Numbers spread evenly over [0, 1).

    Args:
        seed: of the flight.
        key: what tells this stream from all others of the link faults.
    """

    __slots__ = ("_generator", "_waiting")

    def __init__(self, seed: int, key: tuple[int, ...]) -> None:
        self._generator = np.random.default_rng(
            np.random.SeedSequence(seed, spawn_key=(_SEED_STREAM, *key))
        )
        self._waiting: list[float] = []

    def next(self) -> float:
        """The next number."""
        if not self._waiting:
            self._waiting = self._generator.random(_AT_ONCE).tolist()
            self._waiting.reverse()
        return self._waiting.pop()

    def hits(self, share: float) -> bool:
        """Whether this one is of a share of all; no number is drawn for a share of 0."""
        return share > 0.0 and self.next() < share

    def exponential(self, mean: float) -> float:
        """An exponentially distributed number."""
        return float(-mean * np.log1p(-self.next()))


class Silences:
    """Stretches in which nothing passes, of a two-state (Gilbert) model in continuous time.

    They depend on the draws and the time alone, not on what passes.

    Args:
        bursts: mean length of the silences, and of the time between two.
        draws: the numbers.
    """

    __slots__ = ("_bursts", "_draws", "_from_s", "_until_s")

    def __init__(self, bursts: Bursts, draws: Draws) -> None:
        self._bursts = bursts
        self._draws = draws
        self._from_s = self._until_s = -inf

    def cover(self, time_s: float, begin_s: float) -> bool:
        """Whether a time lies in one.

        Args:
            time_s: s; must not decrease.
            begin_s: the time before which there are none, s.
        """
        if self._until_s < begin_s:
            self._until_s = begin_s
        while time_s >= self._until_s:
            self._from_s = self._until_s + self._draws.exponential(self._bursts.every_s)
            self._until_s = self._from_s + self._draws.exponential(self._bursts.length_s)
        return time_s >= self._from_s


def changed(data: bytes, draws: Draws) -> bytes:
    """The same datagram with one to three of its bytes changed."""
    damaged = bytearray(data)
    count = min(1 + int(3.0 * draws.next()), len(data))
    places: list[int] = []
    while len(places) < count:
        place = int(len(data) * draws.next())
        if place not in places:
            places.append(place)
            damaged[place] ^= 1 + int(255.0 * draws.next())
    return bytes(damaged)
