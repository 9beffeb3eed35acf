"""The controller's records as tables: one for each topic of the log."""

from collections.abc import Callable
from itertools import islice
from typing import Any

import orjson

from companion.export.source import Sighting, Survey, Tell, Topic
from companion.export.tables import LOG_TIME, Begin, Column, Rows, Table, file_stem
from companion.flight.records import CHANNELS
from companion.recording.flight_files import FlightFiles
from companion.recording.schema import Field, frame_of, measure_of

_AXES = {3: "xyz", 4: "wxyz"}
_SPECS = {spec.topic: spec for spec in CHANNELS}
_TOLD_EACH = 2000

Pick = Callable[[dict[str, Any]], Any]
"""Takes a column's value out of a record."""


def write_record_tables(
    files: FlightFiles, found: Survey, begin: Begin, tell: Tell
) -> list[tuple[Table, int]]:
    """Write the controller's records; gives the tables with their numbers of rows.

    Raises:
        FlightFilesError: the log cannot be read.
        OSError: a table cannot be written.
    """
    rows: dict[str, tuple[Rows, list[Pick]]] = {}
    try:
        stems: dict[str, int] = {}
        for name, topic in found.topics.items():
            stem = file_stem(name)
            number = stems[stem] = stems.get(stem, 0) + 1
            table, picks = _table(stem if number == 1 else f"{stem}-{number}", name, topic)
            rows[name] = Rows(table, begin), picks
        # A flight that still goes on has said more since the survey.
        for count, record in enumerate(islice(files.records(), found.records)):
            table_rows, picks = rows[record.topic]
            values = record.values
            table_rows.add([record.time_s, *(pick(values) for pick in picks)])
            if count % _TOLD_EACH == 0:
                tell("records", count, found.records)
    finally:
        for table_rows, _ in rows.values():
            table_rows.close()
    tell("records", found.records, found.records)
    return [(table_rows.table, table_rows.count) for table_rows, _ in rows.values()]


def _table(stem: str, name: str, topic: Topic) -> tuple[Table, list[Pick]]:
    """A topic's table, and what takes each column but the first out of a record."""
    spec = _SPECS.get(name)
    told = {field.name: field for field in spec.fields} if spec else {}
    columns = [LOG_TIME]
    picks: list[Pick] = []
    for field_name, sighting in topic.fields.items():
        field = told.get(field_name, Field(field_name, sighting.kind or "number"))
        for column, pick in _spread(field, sighting):
            columns.append(column)
            picks.append(pick)
    return Table(stem, tuple(columns), spec.description if spec else ""), picks


def _spread(field: Field, sighting: Sighting) -> list[tuple[Column, Pick]]:
    """The columns of a field."""
    name = field.name
    unit, frame = measure_of(name), frame_of(name)
    if sighting.width:
        axes = _AXES.get(sighting.width, [str(k) for k in range(sighting.width)])
        return [
            (
                Column(f"{name}_{axis}", "number", unit, frame, field.description),
                _item(name, k),
            )
            for k, axis in enumerate(axes)
        ]
    if sighting.kind == "json":
        about = f"{field.description}; as JSON" if field.description else "as JSON"
        return [(Column(name, "string", "", "", about), _json(name))]
    kind = sighting.kind or (field.kind if field.kind in _PLAIN else "number")
    if kind == "integer" and field.kind == "number":
        kind = "number"  # all values happened to be whole
    return [(Column(name, kind, unit, frame, field.description), _value(name))]


_PLAIN = ("number", "integer", "boolean", "string")


def _value(name: str) -> Pick:
    return lambda values: values.get(name)


def _item(name: str, k: int) -> Pick:
    def pick(values: dict[str, Any]) -> Any:  # noqa: ANN401 - a number or None
        items = values.get(name)
        return items[k] if items is not None and k < len(items) else None

    return pick


def _json(name: str) -> Pick:
    def pick(values: dict[str, Any]) -> str | None:
        value = values.get(name)
        return None if value is None else orjson.dumps(value).decode()

    return pick
