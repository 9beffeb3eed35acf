"""The parameter protocol, as PX4 speaks it: integers bytewise in the float field.

https://mavlink.io/en/services/parameter.html
"""

import struct
from collections.abc import Iterator

from sitl_shim.autopilot.parameters import (
    ParameterRangeError,
    ParameterStore,
    ParameterType,
    UnknownParameterError,
)
from sitl_shim.mavlink.wire import Message, dialect

_HASH_NAME = "_HASH_CHECK"
_HASH_INDEX = 65535
_UINT32 = 5
_DOES_NOT_EXIST, _OUT_OF_RANGE, _TYPE_MISMATCH = 1, 2, 7


def list_all(store: ParameterStore) -> Iterator[Message]:
    """Answer to PARAM_REQUEST_LIST: the hash, then every parameter."""
    yield _hash_message(store)
    for name in store.names:
        yield value_message(store, name)


def list_changed(store: ParameterStore) -> Iterator[Message]:
    """The parameters that differ from their defaults."""
    for name in store.names:
        if store[name] != store.definition(name).default:
            yield value_message(store, name)


def read(store: ParameterStore, request: Message) -> Message:
    """Answer to PARAM_REQUEST_READ: PARAM_VALUE, or PARAM_ERROR."""
    if request.param_index >= 0:
        if request.param_index >= len(store):
            return _error(request, request.param_id, _DOES_NOT_EXIST)
        return value_message(store, store.names[request.param_index])
    if request.param_id == _HASH_NAME:
        return _hash_message(store)
    if request.param_id not in store:
        return _error(request, request.param_id, _DOES_NOT_EXIST)
    return value_message(store, request.param_id)


def write(store: ParameterStore, request: Message) -> tuple[Message, bool]:
    """Carry out PARAM_SET.

    Returns:
        PARAM_VALUE with the new value, or PARAM_ERROR; and whether the value was taken.
    """
    name = request.param_id
    try:
        if store.definition(name).type != request.param_type:
            return _error(request, name, _TYPE_MISMATCH), False
        store.set(name, decode_value(request.param_value, request.param_type))
    except UnknownParameterError:
        return _error(request, name, _DOES_NOT_EXIST), False
    except ParameterRangeError:
        return _error(request, name, _OUT_OF_RANGE), False
    return value_message(store, name), True


def value_message(store: ParameterStore, name: str) -> Message:
    """PARAM_VALUE of one parameter."""
    kind = store.definition(name).type
    return dialect.MAVLink_param_value_message(
        name.encode(), encode_value(store[name], kind), kind.value, len(store), store.index(name)
    )


def encode_value(value: float, kind: int) -> float:
    """A value as it stands in the float field: the bits of an int32, or the float itself."""
    if kind == ParameterType.INT32:
        return float(struct.unpack("<f", struct.pack("<i", int(value)))[0])
    return value


def decode_value(field: float, kind: int) -> float:
    """The value that stands in the float field."""
    if kind == ParameterType.INT32:
        return float(struct.unpack("<i", struct.pack("<f", field))[0])
    return field


def _hash_message(store: ParameterStore) -> Message:
    bits = float(struct.unpack("<f", struct.pack("<I", store.hash()))[0])
    return dialect.MAVLink_param_value_message(
        _HASH_NAME.encode(), bits, _UINT32, len(store), _HASH_INDEX
    )


def _error(request: Message, name: str, error: int) -> Message:
    return dialect.MAVLink_param_error_message(
        request.get_srcSystem(), request.get_srcComponent(), name.encode(), -1, error
    )
