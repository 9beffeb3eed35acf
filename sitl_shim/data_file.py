"""Reading the simulation's YAML data files into validated, frozen models.

A mistake is told as one paragraph that names the file, the line, the key and the remedy.
"""

import difflib
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

_LARGEST_FILE_BYTES = 1_000_000
_DEEPEST = 40
_FAST_LOADER = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader
_OPENING = (
    yaml.BlockMappingStartToken,
    yaml.BlockSequenceStartToken,
    yaml.FlowMappingStartToken,
    yaml.FlowSequenceStartToken,
)
_CLOSING = (yaml.BlockEndToken, yaml.FlowMappingEndToken, yaml.FlowSequenceEndToken)
# Apart from its own errors, PyYAML fails inside its constructors: for a date that there is not,
# for tags such as `!!int ""`.
_PARSE_ERRORS = (
    yaml.YAMLError,
    ValueError,
    LookupError,
    AttributeError,
    TypeError,
    ArithmeticError,
    RecursionError,
)


class DataFileError(ValueError):
    """A data file is missing, is not YAML, or does not say what its model needs."""


class DataModel(BaseModel):
    """Base of everything that is read from a data file: strict, closed, frozen, finite."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


_Model = TypeVar("_Model", bound=DataModel)


def load_data_file(path: Path, model: type[_Model], what: str) -> _Model:
    """Read and validate one file.

    Args:
        path: the file.
        model: what it must hold; sequences arrive as tuples.
        what: the kind of file, for messages ("vehicle", "scenario", ...).

    Raises:
        DataFileError: the file cannot be read, is not YAML, or does not fit the model.
    """
    try:
        if path.stat().st_size > _LARGEST_FILE_BYTES:
            raise DataFileError(f"{what} file {path}: larger than 1 MB, which no such file is.")
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DataFileError(
            f"{what} file {path}: cannot be read ({error}); give the path of a readable YAML file."
        ) from error
    return parse_data(text, model, f"{what} file {path}")


def parse_data(text: str, model: type[_Model], where: str) -> _Model:
    """Validate YAML text.

    Args:
        text: the YAML.
        model: what it must hold; sequences arrive as tuples.
        where: what messages begin with.

    Raises:
        DataFileError: it is not YAML, or does not fit the model.
    """
    root, data = _parsed(text, where)
    if not isinstance(root, yaml.MappingNode):
        raise DataFileError(
            f"{where}: must be a mapping of keys to values; "
            f"the keys are {', '.join(model.model_fields)}."
        )
    _refuse_duplicates(root, where)
    try:
        return model.model_validate(data)
    except ValidationError as error:
        complaints = [_complaint(detail, root, model) for detail in error.errors()]
        raise DataFileError(f"{where}: " + " ".join(complaints)) from error


def _parsed(text: str, where: str) -> tuple[yaml.Node | None, Any]:
    """Nodes and values of a text.

    Raises:
        DataFileError: it is not YAML, or would grow without end.
    """
    try:
        try:
            return _parsed_by(_FAST_LOADER, text, where)
        except _PARSE_ERRORS as error:
            if isinstance(error, DataFileError):
                raise
            return _parsed_by(yaml.SafeLoader, text, where)  # it says better what is wrong
    except DataFileError:
        raise
    except _PARSE_ERRORS as error:
        problem = str(error) or type(error).__name__
        raise DataFileError(f"{where}: is not valid YAML: {problem}") from error


def _parsed_by(loader_class: Any, text: str, where: str) -> tuple[yaml.Node | None, Any]:  # noqa: ANN401 - PyYAML's
    _refuse_what_explodes(loader_class, text, where)
    loader = loader_class(text)
    try:
        root = loader.get_single_node()
        data = None if root is None else _with_tuples(loader.construct_document(root))
    finally:
        loader.dispose()
    return root, data


def _refuse_what_explodes(loader_class: Any, text: str, where: str) -> None:  # noqa: ANN401 - PyYAML's
    """Look through the tokens, which takes no more memory than the text."""
    depth = 0
    for token in yaml.scan(text, Loader=loader_class):
        if isinstance(token, _OPENING):
            depth += 1
        elif isinstance(token, _CLOSING):
            depth -= 1
        if depth > _DEEPEST or isinstance(token, yaml.AliasToken):
            line = token.start_mark.line + 1
            raise DataFileError(
                f"{where}: nests too deeply: line {line} has an alias (*), or is more than "
                f"{_DEEPEST} levels deep; write out what is meant."
            )


def resolve_data_path(name_or_path: str | Path, folder: Path, what: str) -> Path:
    """The file of a bare name within `folder`, or the path itself.

    What holds a path separator or ends in ``.yaml`` or ``.yml`` is a path; else it is a name.

    Raises:
        DataFileError: there is no file of that name.
    """
    text = str(name_or_path)
    path = Path(name_or_path)
    if isinstance(name_or_path, Path) or path.suffix in (".yaml", ".yml") or path.name != text:
        return path
    candidate = folder / f"{text}.yaml"
    if not candidate.is_file():
        known = sorted(file.stem for file in folder.glob("*.yaml"))
        raise DataFileError(
            f"there is no {what} called '{text}'; known are {', '.join(known) or 'none'} "
            f"(in {folder}); or give the path of a YAML file."
        )
    return candidate


def _with_tuples(value: Any) -> Any:  # noqa: ANN401 - whatever YAML can hold
    """The same data with tuples for lists, since strict frozen models hold tuples."""
    if isinstance(value, dict):
        return {key: _with_tuples(item) for key, item in value.items()}
    if isinstance(value, list):
        return tuple(_with_tuples(item) for item in value)
    return value


def _refuse_duplicates(node: yaml.Node, where: str) -> None:
    """PyYAML keeps the last of two equal keys silently; here that is an error."""
    if isinstance(node, yaml.SequenceNode):
        for item in node.value:
            _refuse_duplicates(item, where)
    if not isinstance(node, yaml.MappingNode):
        return
    lines: dict[str, int] = {}
    for key, item in node.value:
        line = key.start_mark.line + 1
        if key.value in lines:
            raise DataFileError(
                f"{where}: line {line}: the key '{key.value}' is there already, "
                f"in line {lines[key.value]}; keep one of them."
            )
        lines[key.value] = line
        _refuse_duplicates(item, where)


def _complaint(detail: ErrorDetails, root: yaml.Node, model: type[DataModel]) -> str:
    """One validation error as a sentence with line, key and remedy."""
    location = detail["loc"]
    line = _line_of(root, location)
    key = ".".join(str(part) for part in location) or "(the whole file)"
    if detail["type"] == "extra_forbidden":
        near = difflib.get_close_matches(str(location[-1]), _all_keys(model), n=1)
        remedy = f"did you mean '{near[0]}'?" if near else "remove it."
        return f"line {line}: the key '{key}' is unknown; {remedy}"
    if detail["type"] == "missing":
        return f"line {line}: the key '{key}' is missing; add it."
    message = detail["msg"]
    return f"line {line}: '{key}' cannot be {detail['input']!r}: {message[0].lower()}{message[1:]}."


@cache
def _all_keys(model: type[DataModel]) -> list[str]:
    """Names of all keys of a model and of the models within it (for suggestions only)."""
    properties = dict.fromkeys(model.model_fields)
    for definition in model.model_json_schema().get("$defs", {}).values():
        properties.update(dict.fromkeys(definition.get("properties", {})))
    return list(properties)


def _line_of(root: yaml.Node, location: tuple[int | str, ...]) -> int:
    """Line (from 1) of the deepest part of the location that the file has."""
    node, line = root, root.start_mark.line
    for part in location:
        if isinstance(node, yaml.MappingNode):
            found = next(((key, item) for key, item in node.value if key.value == part), None)
            if found is None:
                continue  # the tag of a union, or a key that is missing
            line, node = found[0].start_mark.line, found[1]
        elif isinstance(node, yaml.SequenceNode) and isinstance(part, int):
            if part >= len(node.value):
                break
            node = node.value[part]
            line = node.start_mark.line
    return line + 1
