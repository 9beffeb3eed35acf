"""From records to JSON, fast enough for the control loop.

`json` spends most of its time on the shortest exact text of each float.  A format string that is
made once for a channel is three times faster; it keeps twelve digits, which is a micrometre in a
thousand kilometres and a microsecond in a million seconds.
"""

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from enum import Enum
from json.encoder import encode_basestring_ascii
from typing import Any

from companion.recording.schema import ChannelSpec

_NUMBER = "%.12g"
_MOST_TEMPLATES = 16


class RecordEncoder:
    """Encodes the records of one channel."""

    __slots__ = ("_arrays", "_lengths", "_others", "_scalars", "_templates")

    def __init__(self, spec: ChannelSpec) -> None:
        self._scalars = tuple(field.name for field in spec.fields if field.kind == "number")
        self._arrays = tuple(field.name for field in spec.fields if field.kind == "array")
        self._others = tuple(
            field.name for field in spec.fields if field.kind not in ("number", "array")
        )
        self._lengths: dict[str, int] = {}
        self._templates: dict[tuple[int, ...], str] = {}

    def encode(self, record: Mapping[str, Any]) -> bytes:
        """UTF-8 JSON of a record; numbers that are not finite become null.

        Any record can be encoded.  One with exactly the channel's fields and with arrays as long
        as in the record before is encoded fast.
        """
        try:
            try:
                return self._by_template(record)
            except _NewLengths:
                self._templates.clear()
                self._lengths = {name: len(record[name]) for name in self._arrays}
                return self._by_template(record)
        except (KeyError, TypeError):
            return _plain_json(record).encode()

    def _by_template(self, record: Mapping[str, Any]) -> bytes:
        """Fill the channel's format string: numbers first, then what is rendered one by one."""
        lengths = self._lengths
        numbers = [record[name] for name in self._scalars]
        for name in self._arrays:
            values = record[name]
            if len(values) != lengths.get(name):
                raise _NewLengths
            numbers += values
        texts = [_plain_json(record[name]) for name in self._others]
        if len(record) != len(self._scalars) + len(self._arrays) + len(texts):
            raise KeyError("a field that the channel does not have")
        nulls: tuple[int, ...] = ()
        try:
            all_finite = math.isfinite(sum(numbers))
        except TypeError:  # a None among them
            all_finite = False
        if not all_finite:
            nulls = tuple(
                place
                for place, value in enumerate(numbers)
                if value is None or not math.isfinite(value)
            )
            numbers = [value for value in numbers if value is not None and math.isfinite(value)]
        template = self._templates.get(nulls) or self._add_template(nulls)
        return (template % (*numbers, *texts)).encode()

    def _add_template(self, nulls: tuple[int, ...]) -> str:
        """Make the format string for records whose numbers at these places are null."""
        count = len(self._scalars) + sum(self._lengths.values())
        slots = iter(["null" if place in nulls else _NUMBER for place in range(count)])
        parts = [_key(name) + next(slots) for name in self._scalars]
        for name in self._arrays:
            items = ",".join(next(slots) for _ in range(self._lengths[name]))
            parts.append(f"{_key(name)}[{items}]")
        parts += [_key(name) + "%s" for name in self._others]
        if len(self._templates) >= _MOST_TEMPLATES:
            self._templates.clear()
        template = "{" + ",".join(parts) + "}"
        self._templates[nulls] = template
        return template


class _NewLengths(Exception):  # noqa: N818 - a signal within this module, not an error
    """An array is not as long as it was."""


def _key(name: str) -> str:
    """A field's name as JSON, ready for a format string."""
    return json.dumps(name).replace("%", "%%") + ":"


def _plain_json(value: Any) -> str:  # noqa: ANN401 - any value
    """JSON of anything, not finite numbers as null."""
    kind = type(value)
    if kind is str:
        return encode_basestring_ascii(value)
    if kind is bool:
        return "true" if value else "false"
    if kind is int:
        return repr(value)
    if value is None:
        return "null"
    try:
        return _ENCODER.encode(value)
    except ValueError:
        return _ENCODER.encode(_finite(value))


def _finite(value: Any) -> Any:  # noqa: ANN401 - any value
    """The same with None for each number that is not finite."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, str | int | None):
        return value
    if isinstance(value, Sequence):
        return [_finite(item) for item in value]
    return _finite(_plain(value))


def _plain(value: Any) -> Any:  # noqa: ANN401 - any value
    """What `json` cannot encode, as something that it can."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return dict(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    return str(value)


_ENCODER = json.JSONEncoder(allow_nan=False, separators=(",", ":"), skipkeys=True, default=_plain)
