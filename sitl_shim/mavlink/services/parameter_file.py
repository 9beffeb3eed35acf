"""The parameters as one file, in the packed format of ArduPilot's `@PARAM/param.pck`.

A header of three uint16 (magic number, entries in the file, parameters in all), then one entry per
parameter in the order of names: a byte of type and flags, a byte that says how many characters of
the name are those of the name before and how many follow (less one), these, the value and, where
flag 1 is set, the default.  https://ardupilot.org/dev/docs/mavlink-get-set-params.html
"""

import struct

from sitl_shim.autopilot.parameters import ParameterStore, ParameterType

NAME = "@PARAM/param.pck"
_MAGIC, _MAGIC_WITH_DEFAULTS = 0x671B, 0x671C
_HEADER = struct.Struct("<HHH")
_INT8, _INT16, _INT32, _FLOAT = 1, 2, 3, 4
_FORMATS = {_INT8: "<b", _INT16: "<h", _INT32: "<i", _FLOAT: "<f"}
_KINDS = {ParameterType.INT32: _INT32, ParameterType.REAL32: _FLOAT}
_HAS_DEFAULT = 0x10
_LONGEST_COMMON = 15


def packed_parameters(store: ParameterStore, query: str = "") -> bytes:
    """The file.

    Args:
        store: the parameters.
        query: what follows the name's question mark: `withdefaults=1`, `start=N`, `count=N`,
            joined by `&`.  What cannot be read is passed over.
    """
    options = _options(query)
    with_defaults = options.get("withdefaults", 0) == 1
    start = max(0, options.get("start", 0))
    count = max(0, options.get("count", 0)) or len(store)
    names = store.names[start : start + count]
    magic = _MAGIC_WITH_DEFAULTS if with_defaults else _MAGIC
    parts = [_HEADER.pack(magic, len(names), len(store))]
    before = ""
    for name in names:
        parts.append(_entry(store, name, before, with_defaults=with_defaults))
        before = name
    return b"".join(parts)


def _entry(store: ParameterStore, name: str, before: str, *, with_defaults: bool) -> bytes:
    definition = store.definition(name)
    kind = _KINDS[definition.type]
    value, default = _packed(kind, store[name]), _packed(kind, definition.default)
    differs = with_defaults and value != default
    common = min(_common(before, name), _LONGEST_COMMON, len(name) - 1)
    rest = name[common:].encode()
    head = bytes([kind | (_HAS_DEFAULT if differs else 0), common | (len(rest) - 1) << 4])
    return head + rest + value + (default if differs else b"")


def _common(one: str, other: str) -> int:
    """How many characters two names begin with alike."""
    count = 0
    for a, b in zip(one, other, strict=False):
        if a != b:
            break
        count += 1
    return count


def _packed(kind: int, value: float) -> bytes:
    return struct.pack(_FORMATS[kind], value if kind == _FLOAT else int(value))


def _options(query: str) -> dict[str, int]:
    options: dict[str, int] = {}
    for part in query.split("&"):
        name, _, value = part.partition("=")
        if value.isascii() and value.isdigit() and len(value) < 6:
            options[name] = int(value)
    return options
