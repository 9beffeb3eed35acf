"""Bash takes ``t=8:mpc-l1`` for five words when it completes; here they become one again.

Readline breaks words at ``=``, ``:`` and ``@``.  Typer would look for the value of an option in the
wrong place, and what it finds must be told to bash without the part that stands there already.
"""

import contextlib
import io
import os
import shlex
import sys
from collections.abc import Callable, Mapping

_BREAKS = frozenset("=:@")
_ASKED = "_COMPANION_COMPLETE"


def glued(words: list[str], cursor: int) -> tuple[list[str], int, str]:
    """Words as they were typed.

    Args:
        words: as bash breaks them.
        cursor: number of the word that is being typed.

    Returns:
        The words, the number of the one that is being typed, and what of it bash has already.

    >>> glued(["companion", "fly", "--switch", "t", "=", "8", ":", "mp"], 7)
    (['companion', 'fly', '--switch', 't=8:mp'], 3, 't=8:')
    """
    joined: list[list[str]] = []
    place, before = cursor, ""
    for number, word in enumerate(words):
        is_break = bool(word) and set(word) <= _BREAKS
        after_break = bool(joined) and bool(joined[-1]) and set(joined[-1][-1]) <= _BREAKS
        if joined and (is_break or after_break) and number > 1:
            joined[-1].append(word)
        else:
            joined.append([word])
        if number == cursor:
            place = len(joined) - 1
            before = "".join(joined[-1] if is_break else joined[-1][:-1])
    if cursor >= len(words):  # nothing is typed of the next word
        if joined and joined[-1] and set(joined[-1][-1]) <= _BREAKS:
            place, before = len(joined) - 1, "".join(joined[-1])
        else:
            place = len(joined)
    return ["".join(parts) for parts in joined], place, before


def run(program: Callable[[], None], environment: Mapping[str, str]) -> None:
    """Run the program, with bash's words mended where bash asks for completions."""
    words = _words(environment)
    if words is None:
        program()
        return
    mended, place, before = glued(*words)
    os.environ["COMP_WORDS"] = "\n".join(shlex.quote(word) for word in mended)
    os.environ["COMP_CWORD"] = str(place)
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said):
            program()
    finally:
        for line in said.getvalue().splitlines():
            sys.stdout.write(line.removeprefix(before) + "\n")


def _words(environment: Mapping[str, str]) -> tuple[list[str], int] | None:
    """What bash wants completed, where it broke a word; None: there is nothing to mend."""
    if environment.get(_ASKED) != "complete_bash":
        return None
    try:
        words = shlex.split(environment["COMP_WORDS"])
        cursor = int(environment["COMP_CWORD"])
    except (KeyError, ValueError):  # an open quote, say: typer's own reading will do
        return None
    return (words, cursor) if any(word and set(word) <= _BREAKS for word in words) else None
