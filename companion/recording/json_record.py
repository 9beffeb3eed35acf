"""From records to JSON, fast enough for the control loop.

`json` spends most of its time on the shortest exact text of each float.  A format string that is
made once for a channel is three times faster; it keeps twelve digits, which is a micrometre in a
thousand kilometres and a microsecond in a million seconds.
"""

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from itertools import chain
from json.encoder import encode_basestring_ascii
from operator import itemgetter
from typing import Any, NamedTuple

from companion.recording.schema import ChannelSpec

_NUMBER = "%.12g"
_MOST_TEMPLATES = 16


_Pick = Callable[[Any], tuple[Any, ...]]
"""Takes some of the items of a record, or of a sequence."""


class _Template(NamedTuple):
    """A format string for records whose numbers are null at certain places."""

    nulls: tuple[int, ...]
    finite: _Pick
    """Of all numbers those that are not."""
    text: str


class RecordEncoder:
    """Encodes the records of one channel."""

    __slots__ = (
        "_arrays",
        "_fields",
        "_lengths",
        "_others",
        "_pick_arrays",
        "_pick_others",
        "_pick_scalars",
        "_scalars",
        "_template",
        "_templates",
    )

    def __init__(self, spec: ChannelSpec) -> None:
        self._scalars = tuple(field.name for field in spec.fields if field.kind == "number")
        self._arrays = tuple(field.name for field in spec.fields if field.kind == "array")
        self._others = tuple(
            field.name for field in spec.fields if field.kind not in ("number", "array")
        )
        self._pick_scalars = _picker(self._scalars)
        self._pick_arrays = _picker(self._arrays)
        self._pick_others = _picker(self._others)
        self._fields = len(spec.fields)
        self._lengths: tuple[int, ...] = ()
        """Of the arrays."""
        self._templates: dict[tuple[int, ...], _Template] = {}
        self._template: _Template | None = None
        """The last one that was used."""

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
                self._template = None
                self._lengths = tuple(map(len, self._pick_arrays(record)))
                return self._by_template(record)
        except (KeyError, TypeError):
            return _plain_json(record).encode()

    def _by_template(self, record: Mapping[str, Any]) -> bytes:
        """Fill the channel's format string: numbers first, then what is rendered one by one."""
        arrays = self._pick_arrays(record)
        if tuple(map(len, arrays)) != self._lengths:
            raise _NewLengths
        numbers = (*self._pick_scalars(record), *chain.from_iterable(arrays))
        texts = [
            encode_basestring_ascii(value) if type(value) is str else _plain_json(value)
            for value in self._pick_others(record)
        ]
        if len(record) != self._fields:
            raise KeyError("a field that the channel does not have")
        template = self._template
        if template is None or not _fits(template, numbers):
            nulls = tuple(place for place, value in enumerate(numbers) if _is_null(value))
            template = self._templates.get(nulls) or self._add_template(nulls)
            self._template = template
        return (template.text % (*template.finite(numbers), *texts)).encode()

    def _add_template(self, nulls: tuple[int, ...]) -> _Template:
        """Make the format string for records whose numbers at these places are null."""
        count = len(self._scalars) + sum(self._lengths)
        slots = iter(["null" if place in nulls else _NUMBER for place in range(count)])
        parts = [_key(name) + next(slots) for name in self._scalars]
        for name, length in zip(self._arrays, self._lengths, strict=True):
            items = ",".join(next(slots) for _ in range(length))
            parts.append(f"{_key(name)}[{items}]")
        parts += [_key(name) + "%s" for name in self._others]
        if len(self._templates) >= _MOST_TEMPLATES:
            self._templates.clear()
        finite = _picker([place for place in range(count) if place not in nulls])
        template = _Template(nulls, finite, "{" + ",".join(parts) + "}")
        self._templates[nulls] = template
        return template


def _picker(keys: Sequence[Any]) -> _Pick:
    """Takes the items of these keys, as a tuple, however few they are."""
    if len(keys) > 1:
        return itemgetter(*keys)
    if not keys:
        return lambda _: ()
    (key,) = keys
    return lambda items: (items[key],)


def _fits(template: _Template, numbers: tuple[Any, ...]) -> bool:
    """True if exactly a template's places are null."""
    try:
        finite = math.isfinite(sum(template.finite(numbers)))
    except TypeError:  # a None among them
        return False
    return finite and all(_is_null(numbers[place]) for place in template.nulls)


def _is_null(number: float | None) -> bool:
    return number is None or not math.isfinite(number)


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
