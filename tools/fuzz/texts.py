"""Variations of texts by their tokens: most are still read to the end, and wrong there."""

import random
import re

_TOKEN = re.compile(r"[A-Za-z_]\w*|[-+]?\.?\d[\w.+-]*|[ \t]+|\n|.", re.DOTALL)
_ODD = (
    *("0", "-0", "1", "-1", "1e3", "1e308", "1e309", "-1e400", "1_000", "0x7f", "0o17", "0b1"),
    *(".nan", ".inf", "-.inf", "nan", "~", "null", "true", "no", "''", '""', "'x'", '"\\x00"', "…"),
    *("2020-13-45", "2001-12-14t21:59:43.10-05:00", "2020-01-01", "0001-01-01", "9999-99-99"),
    *("[]", "{}", "[1, 2, 3]", "[.nan, 1]", "{a: 1}", "[[[[1]]]]", "&a 1", "*a", "!!int ''"),
    *("!!float x", "!!bool x", "!!timestamp x", "!!binary x", "!!set {a}", "!!omap [a: 1]"),
    *("!!python/object:os.system x", "!x 1", "? a", "- 1", ": ", "|", ">", "%YAML 9.9", "---"),
    *("9" * 400, "1" * 5000, "-" + "9" * 40, "0." + "1" * 300, "a" * 3000),
    *("1e-400", "\t", "\x00", "\ud800", "1:30", "!!null 1", "..."),
    *("<<: {a: 1}", "<<: 1", "<<: [1]", "=", "\u2028", "\ufeff", "\x85", "\x07"),
)  # fmt: skip
_BOMBS = (
    "[" * 3000, "{a: " * 500, "- " * 2000,
    "a:\n" + "".join(" " * i + "b:\n" for i in range(1, 200)),
    "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\nd: &d [*c, *c]\n", "a: &a [*a]\n", "? " * 1000,
    "a: " + "'" * 2001, "!" * 500, "k: " + "[1," * 30, "#" * 5000, "a: |\n" + " x\n" * 300,
)  # fmt: skip


def varied(text: str, rng: random.Random, words: list[str]) -> str:
    """A text with some of its tokens and lines changed.

    Args:
        text: the text.
        rng: what to draw from.
        words: names that may mean something there.
    """
    if rng.random() < 0.01:
        return rng.choice(_BOMBS) + text if rng.random() < 0.5 else text + rng.choice(_BOMBS)
    if rng.random() < 0.3:
        text = _other_lines(text, rng)
    tokens = _TOKEN.findall(text)
    for _ in range(rng.choice((0, 1, 1, 1, 2, 3, 6))):
        if not tokens:
            break
        at = rng.randrange(len(tokens))
        match rng.randrange(8):
            case 0 | 1 | 2:
                at = _value_at(tokens, at)
                tokens[at] = rng.choice(_ODD)
            case 3:
                tokens[at] = rng.choice(words)
            case 4:
                del tokens[at]
            case 5:
                tokens.insert(at, rng.choice(("\n", " ", ":", ",", "[", "]", "{", "}", "-", "#")))
            case 6:
                other = rng.randrange(len(tokens))
                tokens[at], tokens[other] = tokens[other], tokens[at]
            case _:
                tokens[at] = tokens[at] + rng.choice(("0", "e9", "x", ".", "-", tokens[at]))
    return "".join(tokens)


def _value_at(tokens: list[str], start: int) -> int:
    """The next token that is a number or a word, or the one at the start."""
    for at in range(start, min(len(tokens), start + 12)):
        if tokens[at][0].isalnum() or tokens[at][0] in "+-.":
            return at
    return start


def _other_lines(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(4):
        case 0:
            del lines[at]
        case 1:
            lines.insert(other, lines[at])
        case 2:
            lines[at] = "  " + lines[at]
        case _:
            lines[at], lines[other] = lines[other], lines[at]
    return "\n".join(lines)
