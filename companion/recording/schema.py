"""Descriptions of a channel's records: field tables, JSON Schemas, units.

Units are in the fields' names (`position_enu_m`), as everywhere in the companion; the schema
repeats them in words for the tools that show a log.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

_UNITS: tuple[tuple[str, str], ...] = (
    # Longest first: the first suffix that fits is taken.
    ("_m_s2", "m/s²"),
    ("_m_s3", "m/s³"),
    ("_rad_s", "rad/s"),
    ("_m_s", "m/s"),
    ("_mm", "mm"),
    ("_rad", "rad"),
    ("_deg", "degrees"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_us", "µs"),
    ("_ms", "ms"),
    ("_s", "s"),
    ("_m", "m"),
)
_FRAMES: tuple[tuple[str, str], ...] = (
    ("_flu_to_enu", "rotation from body FLU to world ENU, (w, x, y, z)"),
    ("_enu", "world frame ENU"),
    ("_flu", "body frame FLU"),
    ("_ned", "world frame NED"),
)


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a channel's records."""

    name: str
    kind: str = "number"
    """number, integer, boolean, string, array (of numbers), object, or any."""
    description: str = ""
    """What it is; unit and frame are added by the name."""


@dataclass(frozen=True, slots=True)
class ChannelSpec:
    """A channel of the log: its topic and the fields of its records."""

    topic: str
    fields: tuple[Field, ...]
    description: str = ""


def measure_of(name: str) -> str:
    """Unit that a field's name says; empty if it says none."""
    return next((unit for suffix, unit in _UNITS if name.endswith(suffix)), "")


def frame_of(name: str) -> str:
    """Frame that a field's name says, in words; empty if it says none."""
    return next((frame for part, frame in _FRAMES if part in name), "")


def unit_of(name: str) -> str:
    """Unit and frame that a field's name says, in words; empty if it says none."""
    return ", ".join(word for word in (measure_of(name), frame_of(name)) if word)


def json_schema(spec: ChannelSpec) -> dict[str, Any]:
    """JSON Schema of a channel's records, in the part of the language that Foxglove reads.

    Foxglove wants one type for each property, and properties for each object; it refuses the
    whole channel otherwise.  So a field of any kind is left out, which a schema may do, and a
    number that was not finite, null in the log, is marked as OpenAPI does: `nullable`.
    """
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": spec.topic,
        "description": spec.description,
        "type": "object",
        "properties": {
            field.name: _property(field) for field in spec.fields if field.kind != "any"
        },
    }


def spec_from_record(topic: str, record: Mapping[str, Any]) -> ChannelSpec:
    """Channel as its first record looks."""
    return ChannelSpec(
        topic, tuple(Field(name, _kind_of_value(value)) for name, value in record.items())
    )


def _property(field: Field) -> dict[str, Any]:
    unit = unit_of(field.name)
    text = field.description + (f" [{unit}]" if unit else "")
    schema: dict[str, Any] = {"description": text.strip(), "type": field.kind}
    if field.kind == "number":
        schema["nullable"] = True
    elif field.kind == "array":
        schema["items"] = {"type": "number", "nullable": True}
    elif field.kind == "object":
        schema["properties"] = {}
    return schema


def _kind_of_value(value: object) -> str:
    if isinstance(value, Enum):
        return _kind_of_value(value.value)
    if hasattr(value, "tolist"):
        return _kind_of_value(value.tolist())
    if isinstance(value, (list, tuple)):
        return "array" if all(_kind_of_value(item) in _NUMERIC for item in value) else "any"
    if dataclasses.is_dataclass(value):
        return "object"
    return next((kind for python, kind in _KINDS if isinstance(value, python)), "any")


_KINDS: tuple[tuple[type, str], ...] = (
    (bool, "boolean"),
    (int, "integer"),
    (float, "number"),
    (str, "string"),
    (Mapping, "object"),
    (Sequence, "array"),
)
_NUMERIC = ("integer", "number")
