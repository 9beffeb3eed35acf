"""Reading a YAML file into a validated model, with errors that a person can act on."""

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

Model = TypeVar("Model", bound=BaseModel)

_LARGEST_FILE_BYTES = 1_000_000


class ConfigError(ValueError):
    """A configuration can't be used; the text names file, line, key and remedy."""


@dataclass(frozen=True, slots=True)
class Source:
    """A parsed YAML mapping and where each of its keys stands."""

    name: str
    """File name, for messages."""
    data: dict[str, Any]
    lines: Mapping[tuple[str, ...], int]
    """Line (from 1) of each key, by its path."""


def read_yaml(path: Path) -> Source:
    """Parse a YAML file that holds one mapping.

    Raises:
        ConfigError: unreadable, too large, not YAML, not a mapping, or with a key twice.
    """
    try:
        if path.stat().st_size > _LARGEST_FILE_BYTES:
            raise ConfigError(f"{path}: larger than 1 MB, which no configuration is.")
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: can't be read: {error}.") from error
    return parse_yaml(text, str(path))


def parse_yaml(text: str, name: str) -> Source:
    """Parse YAML text that holds one mapping; errors as `read_yaml`."""
    try:
        if any(isinstance(token, yaml.AliasToken) for token in yaml.scan(text)):
            raise ConfigError(f"{name}: YAML aliases (*name) are not taken; write the value out.")
        node = yaml.compose(text, Loader=yaml.SafeLoader)
        lines = dict(_lines_of(node, (), name)) if node is not None else {}
        data = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        if isinstance(error, ConfigError):
            raise
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark is not None else ""
        problem = getattr(error, "problem", None) or str(error) or type(error).__name__
        raise ConfigError(f"{name}{where}: not YAML: {problem}.") from error
    if data is None:
        data = {}
    if not isinstance(data, dict) or not all(isinstance(key, str) for key in data):
        raise ConfigError(f"{name}: a mapping of keys to values is expected, as in `key: value`.")
    return Source(name, data, lines)


def _lines_of(
    node: yaml.Node, path: tuple[str, ...], name: str
) -> Iterable[tuple[tuple[str, ...], int]]:
    if isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for key, value in node.value:
            text = str(key.value)
            line = key.start_mark.line + 1
            if text in seen:
                raise ConfigError(f"{name}, line {line}: key '{text}' stands there twice.")
            seen.add(text)
            yield (*path, text), line
            yield from _lines_of(value, (*path, text), name)
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            yield (*path, str(index)), value.start_mark.line + 1
            yield from _lines_of(value, (*path, str(index)), name)


def with_settings(source: Source, settings: Mapping[str, str]) -> Source:
    """Overlay dotted settings (``l1.gamma`` → YAML text of the value) from the command line.

    Raises:
        ConfigError: a value is not YAML, or a path goes through something that has no keys.
    """
    data = _copied(source.data)
    for dotted, text in settings.items():
        target = data
        *parents, last = dotted.split(".")
        for parent in parents:
            inner = target.setdefault(parent, {})
            if not isinstance(inner, dict):
                raise ConfigError(f"--set {dotted}: '{parent}' has no keys below it.")
            target = inner
        try:
            target[last] = yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise ConfigError(f"--set {dotted}={text}: the value is not YAML.") from error
    return Source(source.name, data, source.lines)


def _copied(value: Any) -> Any:  # noqa: ANN401 - any YAML value
    return {k: _copied(v) for k, v in value.items()} if isinstance(value, dict) else value


def validate(model: type[Model], source: Source) -> Model:
    """Build a model from a source.

    Raises:
        ConfigError: one sentence per fault, each with file, line, key and remedy.
    """
    try:
        return model.model_validate(source.data)
    except ValidationError as error:
        faults = [_sentence(model, source, dict(fault)) for fault in error.errors()]
        raise ConfigError("\n".join(faults)) from error


def _sentence(model: type[BaseModel], source: Source, fault: dict[str, Any]) -> str:
    path = tuple(str(part) for part in fault["loc"])
    line = next(
        (source.lines[path[:k]] for k in range(len(path), 0, -1) if path[:k] in source.lines), None
    )
    where = source.name + (f", line {line}" if line is not None else "")
    key = ".".join(path)
    if fault["type"] == "extra_forbidden":
        known = _known_keys(model, path[:-1])
        close = difflib.get_close_matches(path[-1], known, n=1)
        remedy = f"Did you mean '{close[0]}'?" if close else f"Known keys: {', '.join(known)}."
        return f"{where}: unknown key '{key}'. {remedy}"
    if fault["type"] == "missing":
        return f"{where}: key '{key}' is missing. Add it."
    text = str(fault["msg"]).removeprefix("Value error, ")
    text = text[0].lower() + text[1:]
    given = "" if path == () else f" (given: {fault.get('input')!r})"
    return f"{where}: '{key or 'the file'}': {text}{given}."


def _known_keys(model: type[BaseModel], path: tuple[str, ...]) -> list[str]:
    current: Any = model
    for part in path:
        field = current.model_fields.get(part) if hasattr(current, "model_fields") else None
        current = field.annotation if field is not None else None
        for candidate in getattr(current, "__args__", ()):
            if hasattr(candidate, "model_fields"):
                current = candidate
    return sorted(current.model_fields) if hasattr(current, "model_fields") else []
