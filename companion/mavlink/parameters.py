"""Parameters of the autopilot: their encoding on the wire, and the messages.

Service: https://mavlink.io/en/services/parameter.html.  PX4 puts the bytes of an integer into
the float field, ArduPilot its value.  Both are handled as bytes here: a float that happens to
hold an integer's bytes may be a NaN, whose bits do not survive Python's floats.
"""

import math
import struct
from dataclasses import dataclass
from enum import IntEnum

from companion.mavlink.dialects.base import ParameterEncoding
from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId, Outgoing, Target

_VALUE = struct.Struct("<4sHH16sB")
_SET = struct.Struct("<4sBB16sB")
_REQUEST = struct.Struct("<hBB16s")
_ERROR = struct.Struct("<hBB16sB")
_LONGEST_NAME = 16


class ParameterType(IntEnum):
    """MAV_PARAM_TYPE, as far as it fits the four bytes of the field."""

    UINT8 = 1
    INT8 = 2
    UINT16 = 3
    INT16 = 4
    UINT32 = 5
    INT32 = 6
    REAL32 = 9


_FORMATS: dict[ParameterType, struct.Struct] = {
    ParameterType.UINT8: struct.Struct("<Bxxx"),
    ParameterType.INT8: struct.Struct("<bxxx"),
    ParameterType.UINT16: struct.Struct("<Hxx"),
    ParameterType.INT16: struct.Struct("<hxx"),
    ParameterType.UINT32: struct.Struct("<I"),
    ParameterType.INT32: struct.Struct("<i"),
    ParameterType.REAL32: struct.Struct("<f"),
}
_FLOAT = _FORMATS[ParameterType.REAL32]

_ERRORS = {
    1: "there is no such parameter",
    2: "the value is out of range",
    3: "permission denied",
    4: "the component was not found",
    5: "the parameter is read-only",
    6: "the type is not supported",
    7: "the type does not match",
    8: "the read failed",
}


class ParameterError(ValueError):
    """A name or value that no parameter of that type can have."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter as the autopilot reports it."""

    name: str
    value: int | float
    kind: ParameterType


def name_bytes(name: str) -> bytes:
    """A parameter's name as it is sent.

    Raises:
        ParameterError: it is empty, longer than 16 bytes or not ASCII.
    """
    if not name or len(name) > _LONGEST_NAME or not name.isascii():
        raise ParameterError(f"{name!r} cannot be a parameter: names have 1 to 16 ASCII letters")
    return name.encode("ascii")


def encode_value(value: float, kind: ParameterType, encoding: ParameterEncoding) -> bytes:
    """A value as the four bytes of the field.

    Raises:
        ParameterError: the value does not fit the type.
    """
    if not math.isfinite(value):
        raise ParameterError(f"a parameter cannot be {value}")
    if kind is not ParameterType.REAL32 and value != int(value):
        raise ParameterError(f"the parameter is of type {kind.name}, so it cannot be {value}")
    try:
        exact = _FORMATS[kind].pack(value if kind is ParameterType.REAL32 else int(value))
    except (struct.error, OverflowError) as error:
        raise ParameterError(f"the type {kind.name} cannot hold {value}") from error
    if encoding is ParameterEncoding.BYTEWISE:
        return exact
    return _FLOAT.pack(float(value))


def decode_value(data: bytes, kind: ParameterType, encoding: ParameterEncoding) -> int | float:
    """The value in the four bytes of the field.

    Raises:
        ParameterError: an integer by C cast that is not finite.
    """
    if encoding is ParameterEncoding.BYTEWISE or kind is ParameterType.REAL32:
        value: int | float = _FORMATS[kind].unpack(data)[0]
        return value
    as_float: float = _FLOAT.unpack(data)[0]
    if not math.isfinite(as_float):
        raise ParameterError(f"the autopilot reports {as_float} for a whole number")
    return round(as_float)


def parameter_from_frame(frame: Frame, encoding: ParameterEncoding) -> Parameter | None:
    """Read a PARAM_VALUE; None if its type does not fit the field (64 bits) or means nothing."""
    data, _, _, name, kind = _VALUE.unpack_from(frame.payload.ljust(_VALUE.size, b"\0"))
    try:
        known = ParameterType(kind)
        value = decode_value(data, known, encoding)
    except ValueError:
        return None
    return Parameter(_text(name), value, known)


def error_from_frame(frame: Frame) -> tuple[str, str]:
    """Read a PARAM_ERROR: the parameter's name, and what is wrong in words."""
    _, _, _, name, error = _ERROR.unpack_from(frame.payload.ljust(_ERROR.size, b"\0"))
    return _text(name), _ERRORS.get(error, f"error {error}")


def read_request(name: str, target: Target) -> Outgoing:
    """PARAM_REQUEST_READ by name.

    Raises:
        ParameterError: the name cannot be a parameter's.
    """
    return Outgoing(MessageId.PARAM_REQUEST_READ, _REQUEST.pack(-1, *target, name_bytes(name)))


def set_request(
    name: str, value: float, kind: ParameterType, encoding: ParameterEncoding, target: Target
) -> Outgoing:
    """PARAM_SET.

    Raises:
        ParameterError: the name cannot be a parameter's, or the value does not fit the type.
    """
    data = encode_value(value, kind, encoding)
    return Outgoing(MessageId.PARAM_SET, _SET.pack(data, *target, name_bytes(name), kind))


def _text(data: bytes) -> str:
    return data.split(b"\0", 1)[0].decode("ascii", errors="replace")
