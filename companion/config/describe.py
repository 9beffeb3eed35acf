"""What a YAML file may say, read from its model: names, types, units, defaults, limits, texts.

The reference page, the JSON Schemas' hover texts and the templates of ``companion new`` are made
of this, so that none of them can differ from what is read.
"""

import ast
import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from companion.config.shapes import Shape, shape_of
from companion.config.units import TYPE_KEY, UNIT_KEY, unit_of

_ONE_LINE = 1_000_000


@dataclass(frozen=True, slots=True)
class SectionDescription:
    """A mapping of keys: a whole file, or what stands below one of its keys."""

    name: str
    """Of the model's class, without `Config`: ``Mission``."""
    text: str
    """What it is, in a sentence or more; from the class's docstring."""
    keys: tuple["KeyDescription", ...]
    """In the order in which the model has them."""


@dataclass(frozen=True, slots=True)
class KeyDescription:
    """One key of a YAML file."""

    path: str
    """Dotted, from the file's top: ``l1.gamma``; ``[]`` for entries of a list and ``*`` for names
    of one's own: ``link.forward[].url``, ``parameters.*.low``."""
    name: str
    type: str
    """What is written there, in words: ``number``, ``3 numbers``, ``list of texts``; ``section``,
    ``list of sections``, ``sections by name``; ``one of`` where there are `choices`."""
    unit: str
    """Empty where there is none, or where nothing says it."""
    required: bool
    default: str
    """As YAML, on one line; empty where the key is required, and for a section whose keys all have
    defaults of their own."""
    limits: str
    """``> 0``, ``2 … 200``; empty where there are none."""
    choices: tuple[str, ...]
    """The only values, as YAML; empty where others are taken."""
    text: str
    """What it means; empty where nothing says it."""
    example: str = ""
    """A value to begin with, as YAML; empty where the model names none."""
    sections: tuple[SectionDescription, ...] = ()
    """What stands below it: nothing for a plain value; one section; or several of which an entry
    is one (kinds of wind, say)."""


def describe(model: type[BaseModel]) -> SectionDescription:
    """Describe everything that a file of a model may say.

    Args:
        model: of the whole file: ``MissionConfig``, ``ControllerConfig``, …; its descriptions are
            those of `Field`, or the docstrings below the fields.

    Returns:
        Its keys, with those of all sections below them.
    """
    return _section(model, "")


def every_key(section: SectionDescription) -> Iterator[KeyDescription]:
    """All keys, depth first, in the order of the models."""
    for key in section.keys:
        yield key
        for inner in key.sections:
            yield from every_key(inner)


def models_in(model: type[BaseModel]) -> dict[str, type[BaseModel]]:
    """A model and all models of sections in it, by the names of their classes."""
    found: dict[str, type[BaseModel]] = {}
    waiting = [model]
    while waiting:
        one = waiting.pop()
        if one.__name__ in found:
            continue
        found[one.__name__] = one
        for field in one.model_fields.values():
            waiting += shape_of(field.annotation, tuple(field.metadata)).models
    return found


def text_of(model: type[BaseModel], name: str) -> str:
    """What a field of a model means.

    Its description, else the docstring below it, else what the one section or the one word is that
    may stand there.
    """
    field = model.model_fields[name]
    if field.description is not None:
        return _plain(field.description)
    for base in model.__mro__:
        if name in (found := _docstrings(base)):
            return _plain(found[name])
    shape = shape_of(field.annotation, tuple(field.metadata))
    if len(shape.choices) == 1:
        return f"Which kind it is: {shape.choices[0]}."
    return section_text(shape.models[0]) if len(shape.models) == 1 else ""


def unit_of_field(name: str, field: FieldInfo) -> str:
    """The unit of a field: the one that is said of it, else the end of its name."""
    return str(_extra(field).get(UNIT_KEY, unit_of(name)))


def default_text(field: FieldInfo) -> str:
    """A field's default as YAML on one line; empty where it has none, or is a section."""
    if field.is_required():
        return ""
    default = field.get_default(call_default_factory=True, validated_data={})
    return "" if isinstance(default, BaseModel) else yaml_text(default)


def yaml_text(value: object) -> str:
    """A plain value as YAML on one line."""
    text = yaml.safe_dump(
        _with_lists(value),
        default_flow_style=True,
        width=_ONE_LINE,
        allow_unicode=True,
        sort_keys=False,
    )
    return text.removesuffix("\n").removesuffix("...").rstrip()


def section_text(model: type[BaseModel]) -> str:
    """What a section is: its class's docstring as one paragraph for each of its own."""
    return _plain(inspect.cleandoc(model.__doc__ or ""))


def _section(model: type[BaseModel], prefix: str) -> SectionDescription:
    keys = tuple(_key(model, name, prefix) for name in model.model_fields)
    return SectionDescription(model.__name__.removesuffix("Config"), section_text(model), keys)


def _key(model: type[BaseModel], name: str, prefix: str) -> KeyDescription:
    field = model.model_fields[name]
    shape = shape_of(field.annotation, tuple(field.metadata))
    path = f"{prefix}{name}"
    return KeyDescription(
        path=path,
        name=name,
        type=str(_extra(field).get(TYPE_KEY, shape.words)),
        unit=unit_of_field(name, field),
        required=field.is_required(),
        default=default_text(field),
        limits="" if TYPE_KEY in _extra(field) else shape.limits,
        choices=tuple(yaml_text(choice) for choice in shape.choices),
        text=text_of(model, name),
        example=yaml_text(field.examples[0]) if field.examples else "",
        sections=tuple(_section(inner, f"{path}{_below(shape)}.") for inner in shape.models),
    )


def _below(shape: Shape) -> str:
    """What a path has between a key and the keys of a section below it."""
    return {"one": "", "list": "[]", "by name": ".*"}[shape.holds]


def _extra(field: FieldInfo) -> dict[str, Any]:
    extra = field.json_schema_extra
    return dict(extra) if isinstance(extra, dict) else {}


def _with_lists(value: object) -> object:
    if isinstance(value, BaseModel):
        return _with_lists(value.model_dump())
    if isinstance(value, dict):
        return {key: _with_lists(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_with_lists(item) for item in value]
    return value


def _plain(text: str) -> str:
    """Paragraphs without line breaks of their own; list entries stay on their lines."""
    paragraphs = re.split(r"\n\s*\n", text.strip().replace("``", "`"))
    return "\n\n".join(re.sub(r"\s*\n\s*(?!- )", " ", one.strip()) for one in paragraphs)


def _docstrings(model: type) -> dict[str, str]:
    """The docstrings that stand below the fields of a class, by the fields' names."""
    path = inspect.getsourcefile(model) if model.__module__ not in ("builtins", "abc") else None
    return {} if path is None else _docstrings_of_file(Path(path)).get(model.__name__, {})


@lru_cache(maxsize=64)
def _docstrings_of_file(path: Path) -> dict[str, dict[str, str]]:
    found: dict[str, dict[str, str]] = {}
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if not isinstance(node, ast.ClassDef):
            continue
        texts = found.setdefault(node.name, {})
        for statement, after in zip(node.body, node.body[1:], strict=False):
            if (
                isinstance(statement, ast.AnnAssign)
                and isinstance(statement.target, ast.Name)
                and isinstance(after, ast.Expr)
                and isinstance(after.value, ast.Constant)
                and isinstance(after.value.value, str)
            ):
                texts[statement.target.id] = inspect.cleandoc(after.value.value)
    return found
