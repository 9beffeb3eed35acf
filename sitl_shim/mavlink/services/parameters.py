"""The parameter protocol, as PX4 speaks it: integers bytewise in the float field.

https://mavlink.io/en/services/parameter.html
"""

import struct
from collections.abc import Callable, Iterator, Mapping
from itertools import islice

from sitl_shim.autopilot.parameters import (
    ParameterRangeError,
    ParameterStore,
    ParameterType,
    UnknownParameterError,
)
from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.wire import Message, dialect

_HASH_NAME = "_HASH_CHECK"
_HASH_INDEX = 65535
_UINT32 = 5
_DOES_NOT_EXIST, _OUT_OF_RANGE, _TYPE_MISMATCH = 1, 2, 7


_PER_TICK = 4
"""Messages of a list that leave at one tick: PX4 sends 888 in 0.9 s."""
_TELLS_US = 480_000
"""PX4 tells unasked, while it boots, which parameters the airframe has set."""


class Parameters:
    """The parameter protocol on all links.

    Args:
        context: of the vehicle.
    """

    def __init__(self, context: Context) -> None:
        self._context = context
        self._lists: dict[int, Iterator[Message]] = {}
        """What is left of the lists that are being sent, by link."""

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        return {
            "PARAM_REQUEST_LIST": self._list,
            "PARAM_REQUEST_READ": self._read,
            "PARAM_SET": self._set,
        }

    def step(self, now_us: int) -> None:
        """Send the next part of the lists."""
        if now_us == _TELLS_US:
            for link in range(len(self._context.links)):
                self._lists[link] = list_changed(self._context.sim.autopilot.parameters)
        for link, rest in list(self._lists.items()):
            batch = list(islice(rest, _PER_TICK))
            for message in batch:
                self._context.links[link].send(message)
            if len(batch) < _PER_TICK:
                del self._lists[link]

    def _list(self, link: int, message: Message) -> None:
        if self._context.concerns(message, any_system=True):
            self._lists[link] = list_all(self._context.sim.autopilot.parameters)

    def _read(self, link: int, message: Message) -> None:
        if self._context.concerns(message):
            store = self._context.sim.autopilot.parameters
            self._context.links[link].send(read(store, message))

    def _set(self, link: int, message: Message) -> None:
        if not self._context.concerns(message):
            return
        reply, taken = write(self._context.sim.autopilot.parameters, message)
        for index, each in enumerate(self._context.links):
            if taken or index == link:  # every other link hears of a change, too
                each.send(reply)


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
