"""YAML files to begin with, written from the models: every key, what it means, what it is.

Lines that begin with ``#`` and no space are keys with their defaults: without the ``#`` they count.
"""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from companion.config.describe import KeyDescription, SectionDescription, yaml_text

_WIDTH = 96
_STEP = "  "

Shown = Callable[[KeyDescription], bool]


def template(
    section: SectionDescription,
    values: Mapping[str, Any],
    head: Sequence[str],
    shown: Shown = lambda _: True,
) -> str:
    """A YAML file with every key of a model.

    Args:
        section: the whole file, as `describe` gives it.
        values: keys that are set, with those of sections below them; all others are commented out,
            with their defaults.
        head: comment lines at the top, without ``#``; an empty one is an empty comment.
        shown: whether a key of the file's top is there at all.

    Returns:
        The file's text.
    """
    lines = [f"# {line}".rstrip() for line in head]
    for key in section.keys:
        if shown(key):
            lines += ["", *_lines(key, values, 0)]
    return "\n".join(lines) + "\n"


def facts_of(key: KeyDescription) -> str:
    """Unit, limits, choices and default of a key, in one line."""
    default = "" if key.sections or not key.default else f"default: {key.default}"
    if default == "default: null":
        default = "none by default"
    choices = f"one of {', '.join(key.choices)}" if key.choices else ""
    kind = "" if key.choices or key.sections else key.type
    return "; ".join(part for part in (kind, key.unit, key.limits, choices, default) if part)


def _lines(key: KeyDescription, values: Mapping[str, Any], depth: int) -> list[str]:
    """A key with its comment, and what is below it."""
    live = key.name in values
    value = values.get(key.name)
    lines = _comment(key, depth, live=live)
    if live and isinstance(value, str) and len(value) > _WIDTH:
        return [*lines, f"{_STEP * depth}{key.name}: >-", *_folded(value, depth + 1)]
    if not key.sections:
        shown = yaml_text(value) if live else key.example or key.default or "…"
        return [*lines, f"{_STEP * depth}{'' if live else '#'}{key.name}: {shown}"]
    if live and not (isinstance(value, Mapping) and key.type == "section"):
        return [*lines, *_written(key.name, value, depth)]
    lines.append(f"{_STEP * depth}{'' if live else '#'}{key.name}:")
    if key.type == "sections by name":
        return [*lines, *_entry(key, depth + 1, "NAME:")]
    if key.type == "list of sections":
        return [*lines, *_entry(key, depth + 1, "-")]
    for inner in key.sections[0].keys:
        lines += _lines(inner, value if isinstance(value, Mapping) else {}, depth + 1)
    return lines


def _comment(key: KeyDescription, depth: int, *, live: bool = False) -> list[str]:
    is_left_out = key.sections and key.default == "null" and not live
    optional = " Left out by default." if is_left_out else ""
    facts = facts_of(key)
    section = key.sections[0].text if key.sections and not key.text else ""
    text = f"{key.text or section}{optional}"
    told = f"({facts})" if facts else ""
    width = _WIDTH - len(_STEP) * depth - 2
    together = f"{text} {told}".strip()
    lines = [together] if len(together) <= width else [*text.split("\n"), told]
    return [
        f"{_STEP * depth}# {line}"
        for paragraph in lines
        for line in textwrap.wrap(paragraph, width, break_long_words=False, break_on_hyphens=False)
    ]


def _folded(text: str, depth: int) -> list[str]:
    """A long text as YAML folds it: its lines are joined by spaces when it is read."""
    width = _WIDTH - len(_STEP) * depth
    return [f"{_STEP * depth}{line}" for line in textwrap.wrap(text, width)]


def _entry(key: KeyDescription, depth: int, mark: str) -> list[str]:
    """One entry of a list, or one named section, commented out, with what its keys mean."""
    inner = key.sections[0].keys
    lines = []
    if mark != "-":
        lines.append(f"{_STEP * depth}#{mark}")
    for number, one in enumerate(inner):
        shown = one.example or one.default or "…"
        lines += _comment(one, depth + 1)
        lead = f"{_STEP * depth}#- " if mark == "-" and number == 0 else f"{_STEP * (depth + 1)}#"
        lines.append(f"{lead}{one.name}: {shown}")
    return lines


def _written(name: str, value: object, depth: int) -> list[str]:
    """A value below its key: sections by name one to a line, lists one entry to a line."""
    indent = _STEP * depth
    if isinstance(value, Mapping):
        inner = [f"{indent}{_STEP}{one}: {yaml_text(given)}" for one, given in value.items()]
        return [f"{indent}{name}:", *inner]
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [f"{indent}{name}:", *(f"{indent}{_STEP}- {yaml_text(one)}" for one in value)]
    return [f"{indent}{name}: {yaml_text(value)}"]
