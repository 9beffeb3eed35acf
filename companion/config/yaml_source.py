"""Parsing YAML into a mapping that knows where each of its keys stands."""

import copy
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from companion.yaml_tokens import FAST_LOADER, PARSE_ERRORS, find_flaw

_LARGEST_FILE_BYTES = 1_000_000
_DEEPEST = 40
"""Levels of nesting: libyaml's own stack would end before Python's does."""


class ConfigError(ValueError):
    """A configuration can't be used; the text names file, line, key and remedy."""


class _Loader(yaml.SafeLoader):
    """PyYAML's, and numbers such as ``1e3``, which YAML 1.2 takes and PyYAML reads as text."""


class _FastLoader(FAST_LOADER):  # type: ignore[misc]
    """The same on libyaml, which is ten times as fast, and vaguer about what is wrong."""


for _loader in (_Loader, _FastLoader):
    _loader.add_implicit_resolver(
        "tag:yaml.org,2002:float",
        re.compile(r"^[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$"),
        list("-+.0123456789"),
    )


@dataclass(frozen=True, slots=True)
class Source:
    """A parsed YAML mapping and where each of its keys stands."""

    name: str
    """File name, for messages."""
    data: dict[str, Any]
    lines: Mapping[tuple[str, ...], int]
    """Line (from 1) of each key, by its path."""
    options: Mapping[tuple[str, ...], str] = field(default_factory=dict)
    """The option of the command line that set a key, by the key's path, for messages."""


def read_yaml(path: Path) -> Source:
    """Parse a YAML file that holds one mapping.

    Raises:
        ConfigError: unreadable, too large, not YAML, not a mapping, with aliases, or with a key
            twice.
    """
    try:
        if path.stat().st_size > _LARGEST_FILE_BYTES:
            raise ConfigError(f"{path}: larger than 1 MB, which no configuration is.")
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(
            f"{path}: can't be read: {error.strerror or error}. Check the path."
        ) from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: can't be read: not UTF-8. Save it as UTF-8.") from error
    return parse_yaml(text, str(path))


def parse_yaml(text: str, name: str) -> Source:
    """Parse YAML text that holds one mapping; errors as `read_yaml`."""
    data, lines = _parsed(text, name)
    if data is None:
        data = {}
    if not isinstance(data, dict) or not all(isinstance(key, str) for key in data):
        raise ConfigError(f"{name}: a mapping of keys to values is expected, as in `key: value`.")
    return Source(name, data, lines)


def _parsed(
    text: str, name: str, *, with_line: bool = True
) -> tuple[Any, dict[tuple[str, ...], int]]:
    data, lines = _parsed_once(text, name, with_line)
    return copy.deepcopy(data), lines


@lru_cache(maxsize=256)
def _parsed_once(text: str, name: str, with_line: bool) -> tuple[Any, dict[tuple[str, ...], int]]:
    """The same texts are read for each of a study's many flights, and PyYAML is slow."""
    try:
        try:
            return _parsed_by(_FastLoader, text, name)
        except PARSE_ERRORS as error:
            if isinstance(error, ConfigError):
                raise
            return _parsed_by(_Loader, text, name)
    except ConfigError:
        raise
    except PARSE_ERRORS as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark is not None and with_line else ""
        problem = getattr(error, "problem", None) or str(error) or type(error).__name__
        raise ConfigError(f"{name}{where}: not YAML: {problem}.") from error


def _parsed_by(
    loader_class: type[_Loader | _FastLoader], text: str, name: str
) -> tuple[Any, dict[tuple[str, ...], int]]:
    _refuse_what_explodes(loader_class, text, name)
    loader = loader_class(text)
    try:
        node = loader.get_single_node()
        if node is None:
            return None, {}
        # A SafeLoader with one more resolver is as safe.
        return loader.construct_document(node), dict(_lines_of(node, (), name))
    finally:
        loader.dispose()


def _refuse_what_explodes(loader_class: type[_Loader | _FastLoader], text: str, name: str) -> None:
    """Refuse a text before it takes memory.

    Raises:
        ConfigError: there are aliases, or too many levels.
    """
    flaw = find_flaw(text, loader_class, _DEEPEST)
    if flaw is None:
        return
    if flaw.kind == "alias":
        raise ConfigError(f"{name}: YAML aliases (*name) are not taken; write the value out.")
    raise ConfigError(
        f"{name}, line {flaw.line}: nests deeper than {_DEEPEST} levels, which no configuration "
        "does."
    )


def _lines_of(
    node: yaml.Node, path: tuple[str, ...], name: str
) -> Iterable[tuple[tuple[str, ...], int]]:
    if isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for key, value in node.value:
            text = str(key.value)
            line = key.start_mark.line + 1
            if text in seen:
                raise ConfigError(
                    f"{name}, line {line}: key '{text}' stands there twice. Leave one of them out."
                )
            seen.add(text)
            yield (*path, text), line
            yield from _lines_of(value, (*path, text), name)
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            yield (*path, str(index)), value.start_mark.line + 1
            yield from _lines_of(value, (*path, str(index)), name)


def with_options(
    source: Source, values: Mapping[str, object], options: Mapping[str, str]
) -> Source:
    """Overlay keys that options of the command line gave.

    Args:
        source: stays as it is.
        values: by key.
        options: how the option of a key is written, where that is not ``--key``.
    """
    named: dict[tuple[str, ...], str] = {(key,): options.get(key, f"--{key}") for key in values}
    return Source(source.name, {**source.data, **values}, source.lines, {**source.options, **named})


def with_settings(source: Source, settings: Mapping[str, str], prefix: str = "") -> Source:
    """Overlay dotted settings (``l1.gamma`` → YAML text of the value) from the command line.

    Args:
        source: stays as it is.
        settings: by dotted key within the source.
        prefix: what stood before the key on the command line (``controller.``), for messages.

    Raises:
        ConfigError: a value is not YAML, or a path goes through something that has no keys.
    """
    data = _copied(source.data)
    options = dict(source.options)
    for dotted, text in settings.items():
        option = f"--set {prefix}{dotted}"
        target = data
        *parents, last = dotted.split(".")
        for parent in parents:
            inner = target.setdefault(parent, {})
            if not isinstance(inner, dict):
                raise ConfigError(f"{option}: '{parent}' has no keys below it.")
            target = inner
        target[last] = _parsed(text, f"{option}={text}", with_line=False)[0]
        options[(*parents, last)] = option
    return Source(source.name, data, source.lines, options)


def _copied(value: Any) -> Any:  # noqa: ANN401 - any YAML value
    return {k: _copied(v) for k, v in value.items()} if isinstance(value, dict) else value


def settings_of(pairs: Sequence[str]) -> dict[str, str]:
    """Values by dotted key from ``KEY=VALUE`` texts, as ``--set`` takes them.

    Raises:
        ConfigError: no such text, or a key given twice.
    """
    settings = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        key = key.strip()
        if not equals or not key:
            raise ConfigError(f"--set {pair}: write KEY=VALUE, as in --set hover_s=2.")
        if key in settings:
            raise ConfigError(f"--set {key} is given twice. Leave one of them out.")
        settings[key] = value
    return settings
