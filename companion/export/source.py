"""What is in the records of a flight that is exported."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from companion.export.errors import ExportError
from companion.recording.flight_files import FlightFiles

_TOLD_EACH = 2000
"""Records between two words about how far it is."""

Tell = Callable[[str, int, int | None], None]
"""Told what is being read or written, how many are done, and of how many (None: not known)."""


class Sighting(NamedTuple):
    """What a field's values look like."""

    kind: str
    """number, integer, boolean, string, json (anything else), or empty: only nulls."""
    width: int
    """Of an array of numbers its greatest length; else 0."""


@dataclass(slots=True)
class Topic:
    """What the records of one topic hold."""

    fields: dict[str, Sighting] = field(default_factory=dict)
    records: int = 0


@dataclass(frozen=True, slots=True)
class Survey:
    """What is in a flight's records, from one reading of them."""

    topics: dict[str, Topic]
    """In the order in which they appear."""
    records: int
    last_s: float
    """Time of the last record; 0 if there is none."""


def survey(files: FlightFiles, tell: Tell) -> Survey:
    """Read all records once, to know what columns there are.

    Raises:
        FlightFilesError: the log cannot be read.
    """
    topics: dict[str, Topic] = {}
    count = 0
    last_s = 0.0
    for record in files.records():
        topic = topics.setdefault(record.topic, Topic())
        topic.records += 1
        seen = topic.fields
        for name, value in record.values.items():
            seen[name] = _merged(seen.get(name, _NOTHING), _sight(value))
        last_s = max(last_s, record.time_s)
        count += 1
        if count % _TOLD_EACH == 0:
            tell("records read", count, None)
    if not count:
        raise ExportError(f"{files.mcap} holds no records: there is nothing to export.")
    return Survey(topics, count, last_s)


_NOTHING = Sighting("", 0)


def _sight(value: object) -> Sighting:
    if value is None:
        return _NOTHING
    if isinstance(value, bool):
        return Sighting("boolean", 0)
    if isinstance(value, int):
        return Sighting("integer", 0)
    if isinstance(value, float):
        return Sighting("number", 0)
    if isinstance(value, str):
        return Sighting("string", 0)
    if isinstance(value, list) and value and all(_is_number(item) for item in value):
        return Sighting("number", len(value))
    return Sighting("json", 0)


def _is_number(value: Any) -> bool:  # noqa: ANN401 - any value
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _merged(one: Sighting, other: Sighting) -> Sighting:
    """What holds both."""
    if one == other or not other.kind:
        return one
    if not one.kind:
        return other
    if one.width and other.width:
        return Sighting("number", max(one.width, other.width))
    if {one.kind, other.kind} == {"number", "integer"} and not one.width + other.width:
        return Sighting("number", 0)
    return Sighting("json", 0)
