"""The parameter protocol: list, read, set, what went wrong, and what changed.

https://mavlink.io/en/services/parameter.html
"""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from itertools import islice

from sitl_shim.autopilot.parameters import (
    ParameterRangeError,
    ParameterStore,
    UnknownParameterError,
)
from sitl_shim.mavlink.services.context import NEVER_US, Context
from sitl_shim.mavlink.services.parameter_messages import (
    HASH_NAME,
    decode_value,
    error_message,
    hash_message,
    value_message,
)
from sitl_shim.mavlink.wire import Message

_PER_TICK = 4
"""Messages of a list that leave at one tick: 888 in 0.9 s."""
_TOLD_AFTER_US = 20_000
"""A change is told on every link, also on the one by which it came, at the next look."""
_MOST_UNTOLD = 256
_DOES_NOT_EXIST, _OUT_OF_RANGE, _TYPE_MISMATCH = 1, 2, 7
"""MAV_PARAM_ERROR."""


class Parameters:
    """The parameter protocol on all links.

    Args:
        context: of the vehicle.
    """

    def __init__(self, context: Context) -> None:
        self._context = context
        self._manners = context.personality
        self._lists: dict[int, Iterator[Message]] = {}
        """What is left of the lists that are being sent, by link."""
        self._changed: deque[tuple[int, str]] = deque(maxlen=_MOST_UNTOLD)
        """When each change is to be told."""

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        return {
            "PARAM_REQUEST_LIST": self._list,
            "PARAM_REQUEST_READ": self._read,
            "PARAM_SET": self._set,
        }

    def step(self, now_us: int) -> int:
        """Send the next part of the lists, and what changed; returns when there is more to do."""
        if now_us == self._manners.tells_parameters_us:
            for link in range(len(self._context.links)):
                self._lists[link] = self._overridden()
        while self._changed and self._changed[0][0] <= now_us:
            _, name = self._changed.popleft()
            for each in self._context.links:
                each.send(self._value(name))
        for link, rest in list(self._lists.items()):
            batch = list(islice(rest, _PER_TICK))
            for message in batch:
                self._context.links[link].send(message)
            if len(batch) < _PER_TICK:
                del self._lists[link]
        if self._lists:
            return 0
        tells_us = self._manners.tells_parameters_us
        return min(
            self._changed[0][0] if self._changed else NEVER_US,
            tells_us if tells_us is not None and now_us < tells_us else NEVER_US,
        )

    @property
    def _store(self) -> ParameterStore:
        return self._context.sim.autopilot.parameters

    def _all(self) -> Iterator[Message]:
        """Answer to PARAM_REQUEST_LIST."""
        store = self._store
        if self._manners.parameter_hash:
            yield hash_message(store)
        for name in store.names:
            yield value_message(store, name, bytewise=self._manners.bytewise_parameters)

    def _overridden(self) -> Iterator[Message]:
        """The parameters that differ from their defaults."""
        store = self._store
        for name in store.names:
            if store[name] != store.definition(name).default:
                yield self._value(name)

    def _value(self, name: str) -> Message:
        return value_message(
            self._store,
            name,
            bytewise=self._manners.bytewise_parameters,
            with_index=self._manners.answers_with_parameter_index,
        )

    def _list(self, link: int, message: Message) -> None:
        if self._context.concerns(message, any_system=True):
            self._lists[link] = self._all()

    def _read(self, link: int, message: Message) -> None:
        if not self._context.concerns(message):
            return
        store, name = self._store, message.param_id
        if message.param_index >= 0:
            known = message.param_index < len(store)
            name = store.names[message.param_index] if known else ""
        elif name == HASH_NAME and self._manners.parameter_hash:
            self._context.links[link].send(hash_message(store))
            return
        if name in store:
            self._context.links[link].send(self._value(name))
        else:
            self._refuse(link, message, _DOES_NOT_EXIST)

    def _set(self, link: int, message: Message) -> None:
        if not self._context.concerns(message):
            return
        store, name = self._store, message.param_id
        try:
            definition = store.definition(name)
            before = store[name]
            bytewise = self._manners.bytewise_parameters
            if bytewise and definition.type != message.param_type:
                self._refuse(link, message, _TYPE_MISMATCH)
                return
            value = decode_value(message.param_value, definition.type, bytewise=bytewise)
            store.set(name, value)
        except UnknownParameterError:
            self._refuse(link, message, _DOES_NOT_EXIST)
            return
        except ParameterRangeError:
            if self._manners.parameter_errors:
                self._refuse(link, message, _OUT_OF_RANGE)
                return
        self._context.links[link].send(self._value(name))
        if store[name] == before:
            return
        if self._manners.tells_changes_again:
            self._changed.append((self._context.sim.time_us + _TOLD_AFTER_US, name))
            return
        for index, other in enumerate(self._context.links):
            if index != link:
                other.send(self._value(name))

    def _refuse(self, link: int, request: Message, error: int) -> None:
        """Say why, where the flavour says anything."""
        if self._manners.parameter_errors:
            self._context.links[link].send(error_message(request, error))
