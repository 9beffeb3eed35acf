"""Messages of the parameter protocol, in the manner of a flavour.

PX4 puts the bits of an integer into the float field, ArduPilot its value.
https://mavlink.io/en/services/parameter.html#parameter-encoding
"""

import math
import struct

from sitl_shim.autopilot.parameters import ParameterStore, ParameterType
from sitl_shim.mavlink.wire import Message, dialect

HASH_NAME = "_HASH_CHECK"
NO_INDEX = 65535
_UINT32 = 5


def value_message(
    store: ParameterStore, name: str, *, bytewise: bool, with_index: bool = True
) -> Message:
    """PARAM_VALUE of one parameter.

    Args:
        store: the parameters.
        name: which one.
        bytewise: how integers stand in the float field.
        with_index: tell its place in the list; else 65535.
    """
    kind = store.definition(name).type
    field = encode_value(store[name], kind, bytewise=bytewise)
    index = store.index(name) if with_index else NO_INDEX
    return dialect.MAVLink_param_value_message(name.encode(), field, kind.value, len(store), index)


def hash_message(store: ParameterStore) -> Message:
    """PARAM_VALUE of the hash over all parameters, which PX4 puts before its list."""
    bits = float(struct.unpack("<f", struct.pack("<I", store.hash()))[0])
    return dialect.MAVLink_param_value_message(
        HASH_NAME.encode(), bits, _UINT32, len(store), NO_INDEX
    )


def error_message(request: Message, error: int) -> Message:
    """PARAM_ERROR to whoever asked.

    Args:
        request: PARAM_REQUEST_READ or PARAM_SET.
        error: MAV_PARAM_ERROR.
    """
    name = request.param_id.encode("ascii", "replace")
    return dialect.MAVLink_param_error_message(
        request.get_srcSystem(), request.get_srcComponent(), name, -1, error
    )


def encode_value(value: float, kind: int, *, bytewise: bool = True) -> float:
    """A value as it stands in the float field."""
    if bytewise and kind == ParameterType.INT32:
        return float(struct.unpack("<f", struct.pack("<i", int(value)))[0])
    return value


def decode_value(field: float, kind: int, *, bytewise: bool = True) -> float:
    """The value that stands in the float field."""
    if kind != ParameterType.INT32:
        return field
    if bytewise:
        return float(struct.unpack("<i", struct.pack("<f", field))[0])
    return float(math.floor(field + 0.5)) if math.isfinite(field) else field
