"""Sequences of what was said, and how two of them differ."""

import difflib
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any

Timed = tuple[float, Hashable]


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
) -> list[str]:
    """What one sequence has and the other has not, and what came at another time.

    What the shim says at the end of the recording, where the real one may not have come to it
    yet, counts only where the real one said it, too.
    """

    def limit_s(value: Hashable) -> float:
        return within_s if isinstance(within_s, float) else within_s(value)

    their_values, our_values = [v for _, v in theirs], [v for _, v in ours]
    matcher = difflib.SequenceMatcher(None, their_values, our_values, autojunk=False)
    found = []
    for tag, i1, i2, j1, j2 in matcher.get_opcodes():
        if tag == "equal":
            for (their_s, value), (our_s, _) in zip(theirs[i1:i2], ours[j1:j2], strict=True):
                if abs(our_s - their_s) > limit_s(value):
                    late = "later" if our_s > their_s else "earlier"
                    found.append(f"{says(value)} comes {late}")
        else:
            found += [f"{says(value)} does not come" for value in their_values[i1:i2]]
            found += [
                f"{says(value)} comes, the real one has none"
                for time_s, value in ours[j1:j2]
                if time_s <= ends_s - limit_s(value)
            ]
    return found
