"""What an annotation of a model's field takes, in words for a person."""

import types
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import annotated_types
from pydantic import BaseModel
from pydantic.fields import FieldInfo

Holds = Literal["one", "list", "by name"]

_WORDS: dict[Any, str] = {
    int: "whole number",
    float: "number",
    str: "text",
    bool: "true or false",
    Any: "anything",
}


@dataclass(frozen=True, slots=True)
class Shape:
    """What may be written in a place."""

    words: str
    limits: str = ""
    choices: tuple[object, ...] = ()
    """The only values; empty where others are taken."""
    models: tuple[type[BaseModel], ...] = ()
    """Sections that may stand there; several are alternatives."""
    holds: Holds = "one"
    """Whether it is one section, a list of them, or sections by names of one's own."""


def shape_of(annotation: object, metadata: tuple[object, ...] = ()) -> Shape:
    """What an annotation takes.

    Args:
        annotation: of a field; None in a union is left out, the default tells of it.
        metadata: constraints that belong to it, as pydantic keeps them beside it.
    """
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return shape_of(arguments[0], (*metadata, *_constraints(arguments[1:])))
    if origin in (Union, types.UnionType):
        return _with_limits(_of_union(arguments), metadata)
    if origin is Literal:
        return Shape("one of", choices=arguments)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return Shape("section", models=(annotation,))
    if origin in (tuple, list):
        return _of_list(arguments, metadata)
    if origin is dict or annotation is dict:
        return _of_mapping(arguments)
    return Shape(_WORDS.get(annotation, "anything"), _limits(metadata, whole=annotation is int))


def _of_union(parts: tuple[object, ...]) -> Shape:
    shapes = [shape_of(part) for part in parts if part is not type(None)]
    if len(shapes) == 1:
        return shapes[0]
    models = tuple(dict.fromkeys(model for shape in shapes for model in shape.models))
    words = dict.fromkeys(shape.words for shape in shapes)
    limits = {shape.limits for shape in shapes}
    choices = tuple(choice for shape in shapes for choice in shape.choices)
    only_choices = all(shape.choices for shape in shapes)
    if choices and not only_choices:
        words = dict.fromkeys(
            " or ".join(str(choice) for choice in shape.choices) if shape.choices else shape.words
            for shape in shapes
        )
    return Shape(
        " or ".join(words),
        limits.pop() if len(limits) == 1 else "",
        choices if only_choices else (),
        models,
        next((shape.holds for shape in shapes if shape.models), "one"),
    )


def _of_list(arguments: tuple[object, ...], metadata: tuple[object, ...]) -> Shape:
    repeated = arguments[-1] is Ellipsis or len(arguments) == 1
    inner = shape_of(arguments[0])
    if inner.models:
        return replace(inner, words="list of sections", holds="list")
    if inner.choices:
        words = "list of " + ", ".join(str(choice) for choice in inner.choices)
    else:
        count = "list of" if repeated else str(len(arguments))
        words = f"{count} {_plural(inner.words)}"
    least = next((one.min_length for one in metadata if isinstance(one, annotated_types.MinLen)), 0)
    return Shape(words + (f", {least} at least" if repeated and least else ""), inner.limits)


def _of_mapping(arguments: tuple[object, ...]) -> Shape:
    inner = shape_of(arguments[1]) if arguments else Shape("anything")
    if inner.models:
        return replace(inner, words="sections by name", holds="by name")
    values = "values" if inner.words == "anything" else _plural(inner.words)
    return Shape(f"keys with {values}")


def _plural(words: str) -> str:
    return " or ".join(
        word if word.startswith(("keys", "true")) else f"{word}s" for word in words.split(" or ")
    )


def _with_limits(shape: Shape, metadata: tuple[object, ...]) -> Shape:
    limits = _limits(metadata)
    return replace(shape, limits=limits) if limits else shape


def _constraints(annotated: tuple[object, ...]) -> Iterable[object]:
    for one in annotated:
        if isinstance(one, FieldInfo):
            yield from one.metadata
        else:
            yield one


def _limits(metadata: tuple[object, ...], *, whole: bool = False) -> str:
    """Bounds of a number in words: ``> 0``, ``2 … 200``, ``0 … 1, 1 excluded``."""
    low: Any = None
    high: Any = None
    low_open = high_open = False
    for one in metadata:
        if isinstance(one, annotated_types.Gt):
            low, low_open = one.gt, True
        elif isinstance(one, annotated_types.Ge):
            low, low_open = one.ge, False
        elif isinstance(one, annotated_types.Lt):
            high, high_open = one.lt, True
        elif isinstance(one, annotated_types.Le):
            high, high_open = one.le, False
    if whole and high_open:
        high, high_open = high - 1, False
    if low is None and high is None:
        return ""
    if high is None:
        return f"{'>' if low_open else '≥'} {_number(low)}"
    if low is None:
        return f"{'<' if high_open else '≤'} {_number(high)}"
    if low_open and high_open:
        return f"between {_number(low)} and {_number(high)}"
    excluded = f", {_number(low if low_open else high)} excluded" if low_open or high_open else ""
    return f"{_number(low)} … {_number(high)}{excluded}"


def _number(value: Any) -> str:  # noqa: ANN401 - whatever can be compared
    return f"{value:g}" if isinstance(value, float) else str(value)
