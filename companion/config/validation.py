"""From a parsed mapping to a validated model, with errors that a person can act on."""

import difflib
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from companion.config.yaml_source import ConfigError, Source

Model = TypeVar("Model", bound=BaseModel)

_LONGEST_SHOWN = 80
_UNKNOWN = "extra_forbidden"


def validate(model: type[Model], source: Source) -> Model:
    """Build a model from a source.

    Raises:
        ConfigError: one sentence per fault, each with file and line (or the option of the command
            line that gave the value), key and remedy.
    """
    try:
        return model.model_validate(source.data)
    except ValidationError as error:
        faults = [dict(fault) for fault in error.errors()]
        glued = {_intended(_path(fault)) for fault in faults if fault["type"] == _UNKNOWN}
        sentences = [
            _sentence(model, source, fault)
            for fault in faults
            if fault["type"] != "missing" or _path(fault) not in glued
        ]
        raise ConfigError("\n".join(dict.fromkeys(sentences))) from error


def _path(fault: dict[str, Any]) -> tuple[str, ...]:
    return tuple(str(part) for part in fault["loc"])


def _intended(path: tuple[str, ...]) -> tuple[str, ...]:
    """Where an unknown key leads if what follows a colon in it was meant as its value."""
    return (*path[:-1], path[-1].partition(":")[0])


def _sentence(model: type[BaseModel], source: Source, fault: dict[str, Any]) -> str:
    path = _path(fault)
    where = _where(source, path)
    key = ".".join(path)
    if fault["type"] == _UNKNOWN:
        known = _known_keys(model, path[:-1])
        if ":" in path[-1]:
            return f"{where}: {_glued(path, known)}"
        longer = [name for name in known if path[-1] and name.startswith(path[-1])]
        close = difflib.get_close_matches(path[-1], known, n=1) or longer
        remedy = f"Did you mean '{close[0]}'?" if close else f"Known keys: {', '.join(known)}."
        return f"{where}: unknown key '{key}'. {remedy}"
    if fault["type"] == "missing" and path[-1].isdigit():
        return f"{where}: '{'.'.join(path[:-1])}' has too few entries. Give one for each axis."
    if fault["type"] == "missing":
        return f"{where}: key '{key}' is missing. Add it."
    if fault["type"] in ("model_type", "model_attributes_type"):
        given = _shown(fault.get("input"))
        return f"{where}: '{key}': keys with values are expected below it (given: {given})."
    text = str(fault["msg"]).removeprefix("Value error, ")
    text = (text[0].lower() + text[1:]).replace("tuple", "list")  # which it is in YAML
    given = f" (given: {_shown(fault.get('input'))})" if path else ""
    return f"{where}: {f'{key!r}: ' if path else ''}{text}{given}.{_remedy(fault)}"


def _glued(path: tuple[str, ...], known: list[str]) -> str:
    """What is wrong with a key that has a colon in it: in YAML that alone ends no key."""
    key, _, value = path[-1].partition(":")
    inside = f" in '{'.'.join(path[:-1])}'" if path[:-1] else ""
    return (
        f"unknown key {_shown(path[-1])}{inside}: YAML wants a space after the colon. Write "
        f"{key}: {_shown_value(value)}. Known keys: {', '.join(known)}."
    )


def _shown_value(text: str) -> str:
    return text if len(text) <= _LONGEST_SHOWN else text[:_LONGEST_SHOWN] + "…"


def _where(source: Source, path: tuple[str, ...]) -> str:
    """The option or the line that is to blame for a fault at a path.

    The closest one above the fault; and for a fault of a whole section (two keys that do not go
    together) each option that set a key in it.
    """
    above = [path[:k] for k in range(len(path), 0, -1)]
    for place in above:
        if place in source.options:
            return source.options[place]
    inside = [name for place, name in source.options.items() if place[: len(path)] == path]
    line = next((source.lines[place] for place in above if place in source.lines), None)
    where = source.name + (f", line {line}" if line is not None else "")
    return f"{where} with {', '.join(inside)}" if inside else where


def _remedy(fault: dict[str, Any]) -> str:
    given = fault.get("input")
    if fault["type"] in ("float_type", "int_type") and isinstance(given, str):
        try:
            float(given)
        except ValueError:
            return ""
        return " Write the number without quotes."
    if fault["type"] == "string_type" and isinstance(given, (int, float)):
        return " Write it in quotes."
    return ""


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST_SHOWN else text[:_LONGEST_SHOWN] + "…"


def _section_in(annotation: Any) -> Any:  # noqa: ANN401 - of any field
    """The model of a section that may be left out, or of those in a list."""
    if hasattr(annotation, "model_fields"):
        return annotation
    found = (_section_in(part) for part in get_args(annotation))
    return next((section for section in found if section is not None), None)


def _known_keys(model: type[BaseModel], path: tuple[str, ...]) -> list[str]:
    current: Any = model
    for part in path:
        if part.isdigit():
            continue  # of a list: its entries' section is known already
        field = current.model_fields.get(part) if hasattr(current, "model_fields") else None
        current = _section_in(field.annotation) if field is not None else None
    return sorted(current.model_fields) if hasattr(current, "model_fields") else []
