"""Sequences of what was said, and how two of them differ."""

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

Timed = tuple[float, Hashable]

_ANOTHER_S = 10.0
"""What comes so much earlier or later is not the same that was said, but said again."""


@dataclass(frozen=True)
class Comparison:
    """What the comparison of one aspect gave."""

    compared: int
    """How much the recording has of it."""
    differences: list[str]

    def __add__(self, other: "Comparison") -> "Comparison":
        return Comparison(self.compared + other.compared, self.differences + other.differences)


def changes(timed: Iterable[Timed]) -> list[Timed]:
    """Each value when it first comes after another one."""
    found: list[Timed] = []
    for time_s, value in timed:
        if not found or found[-1][1] != value:
            found.append((time_s, value))
    return found


def sequence_differences(
    theirs: Sequence[Timed],
    ours: Sequence[Timed],
    *,
    within_s: float | Callable[[Any], float],
    ends_s: float,
    says: Callable[[Any], str] = str,
) -> Comparison:
    """What one sequence has and the other has not, and what came how much earlier or later.

    What the shim says at the end of the recording, where the real one may not have come to it
    yet, counts only where the real one said it, too.
    """

    def limit_s(value: Hashable) -> float:
        return within_s if isinstance(within_s, float) else within_s(value)

    pairs = _pairs(theirs, ours)
    found = []
    for i, j in pairs:
        (their_s, value), (our_s, _) = theirs[i], ours[j]
        if abs(our_s - their_s) > limit_s(value):
            late = "later" if our_s > their_s else "earlier"
            found.append(f"{says(value)} comes {abs(our_s - their_s):.1f} s {late}")
    their_pairs, our_pairs = {i for i, _ in pairs}, {j for _, j in pairs}
    found += [
        f"{says(value)} does not come"
        for i, (_, value) in enumerate(theirs)
        if i not in their_pairs
    ]
    found += [
        f"{says(value)} comes, the real one has none"
        for j, (time_s, value) in enumerate(ours)
        if j not in our_pairs and time_s <= ends_s - limit_s(value)
    ]
    return Comparison(len(theirs), found)


def _pairs(theirs: Sequence[Timed], ours: Sequence[Timed]) -> list[tuple[int, int]]:
    """The longest common subsequence, and of several the one with the least shifts in time."""
    rows, columns = len(theirs), len(ours)
    best = [[(0, 0.0)] * (columns + 1) for _ in range(rows + 1)]
    for i in reversed(range(rows)):
        for j in reversed(range(columns)):
            best[i][j] = max(best[i + 1][j], best[i][j + 1])
            apart_s = abs(theirs[i][0] - ours[j][0])
            if apart_s <= _ANOTHER_S and theirs[i][1] == ours[j][1]:
                count, total_s = best[i + 1][j + 1]
                best[i][j] = max(best[i][j], (count + 1, total_s - apart_s))
    found = []
    i = j = 0
    while i < rows and j < columns:
        if best[i][j] == best[i + 1][j]:
            i += 1
        elif best[i][j] == best[i][j + 1]:
            j += 1
        else:
            found.append((i, j))
            i, j = i + 1, j + 1
    return found
