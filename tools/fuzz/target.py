"""What is fuzzed: the shape of a target, and how it says that something is wrong."""

import random
from collections.abc import Callable
from typing import Protocol


class FindingError(AssertionError):
    """What must not happen has happened; the text says what."""


class Target(Protocol):
    """Makes inputs, and feeds them to a part of the product.

    An input is bytes, whatever they are: what `generate` makes is only the most promising kind.
    The same input does the same always, whatever was run before it.
    """

    unit: str
    """What inputs consist of: "packets", "documents"."""

    def generate(self, rng: random.Random) -> bytes:
        """A new input."""

    def mutate(self, data: bytes, rng: random.Random) -> bytes:
        """A variation of an input."""

    def run(self, data: bytes) -> int:
        """Feed an input.

        Returns:
            How many units it held.

        Raises:
            Exception: any is a finding.
        """

    def pieces(self, data: bytes) -> list[bytes]:
        """An input in parts that can be left out, for trimming."""

    def join(self, pieces: list[bytes]) -> bytes:
        """The input of these parts."""


def trimmed(
    target: Target, data: bytes, fails: Callable[[bytes], bool], *, most_runs: int = 400
) -> bytes:
    """A smaller input that fails in the same way: ever smaller stretches of it are left out."""
    pieces = target.pieces(data)
    size = max(1, len(pieces) // 2)
    runs = 0
    while runs < most_runs:
        start = 0
        smaller = False
        while start < len(pieces) and runs < most_runs:
            rest = pieces[:start] + pieces[start + size :]
            runs += 1
            if rest and fails(target.join(rest)):
                pieces, smaller = rest, True
            else:
                start += size
        if size == 1 and not smaller:
            break
        size = max(1, size // 2)
    return target.join(pieces)
