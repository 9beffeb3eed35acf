"""From records to JSON, fast enough for the control loop.

By `orjson`: numbers are as exact as they were given, those that are not finite become null.
"""

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any

import orjson


def record_json(record: Mapping[str, Any]) -> bytes:
    """UTF-8 JSON of a record; numbers that are not finite become null.

    Any record can be encoded; what JSON cannot say is said as text.
    """
    try:
        return orjson.dumps(record, _plain, orjson.OPT_PASSTHROUGH_DATACLASS)
    except TypeError:  # integers beyond 64 bits, halves of signs, keys that are no text
        return _SLOW.encode(_finite(record)).encode()


def _plain(value: Any) -> Any:  # noqa: ANN401 - any value
    """What the encoders do not know, as something that they do."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, float):
        return float(value)
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return dict(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, tuple):
        return list(value)
    return str(value)


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


_SLOW = json.JSONEncoder(allow_nan=False, separators=(",", ":"), skipkeys=True)
