"""Nothing piles up: how large the containers are that a thing holds."""

from collections import deque
from typing import Any

from tools.fuzz.target import FindingError

_LEAVES = (str, int, float, bool, bytes, bytearray, type, type(None))


def check_small(
    roots: list[object], packages: tuple[str, ...], *, most_items: int, most_bytes: int
) -> None:
    """Look through everything that is reachable by way of objects of some packages.

    Args:
        roots: where to begin.
        packages: beginnings of the modules whose objects are looked into.
        most_items: that a container may hold.
        most_bytes: that a text or a buffer may hold.

    Raises:
        FindingError: something is larger.
    """
    seen: set[int] = set()
    waiting: list[tuple[str, Any]] = [(type(root).__name__, root) for root in roots]
    while waiting:
        name, thing = waiting.pop()
        if isinstance(thing, _LEAVES):
            if isinstance(thing, str | bytes | bytearray) and len(thing) > most_bytes:
                raise FindingError(f"{name} has grown to {len(thing)} bytes")
            continue
        if id(thing) in seen:
            continue
        seen.add(id(thing))
        if isinstance(thing, dict):
            _check(name, len(thing), most_items)
            waiting += [(f"{name}[…]", item) for item in thing.values()]
        elif isinstance(thing, list | tuple | deque | set | frozenset):
            _check(name, len(thing), most_items)
            waiting += [(f"{name}[…]", item) for item in thing]
        elif type(thing).__module__.startswith(packages):
            waiting += [(f"{name}.{key}", getattr(thing, key)) for key in _attributes(thing)]


def _check(name: str, size: int, most: int) -> None:
    if size > most:
        raise FindingError(f"{name} has grown to {size} items")


def _attributes(thing: object) -> list[str]:
    slots = [name for kind in type(thing).__mro__ for name in getattr(kind, "__slots__", ())]
    names = [*slots, *getattr(thing, "__dict__", {})]
    return [name for name in names if hasattr(thing, name)]
