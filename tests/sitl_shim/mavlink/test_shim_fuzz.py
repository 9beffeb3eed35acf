"""Whatever comes in with a right checksum, the shim goes on and stays finite."""

import math
import struct
from collections.abc import Iterator
from dataclasses import astuple

import numpy as np
import pytest

from sitl_shim.mavlink.endpoint import Shim
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Parser, dialect
from sitl_shim.simulation import ShimOptions

_READ = (
    "HEARTBEAT",
    "SET_ATTITUDE_TARGET",
    "COMMAND_LONG",
    "COMMAND_INT",
    "TIMESYNC",
    "PING",
    "FILE_TRANSFER_PROTOCOL",
    "PARAM_REQUEST_LIST",
    "PARAM_REQUEST_READ",
    "PARAM_SET",
)
_NOT_READ = ("PARAM_VALUE", "REQUEST_DATA_STREAM", "SET_POSITION_TARGET_LOCAL_NED")
_IDS = [getattr(dialect, f"MAVLINK_MSG_ID_{name}") for name in _READ + _NOT_READ]
_COMMAND_IDS = _IDS[2:4]
_COMMANDS = (16, 20, 21, 22, 84, 176, 192, 246, 400, 410, 510, 511, 512, 519, 520, 521)
_INTERVAL_COMMANDS = (510, 511)
_STREAMS = (30, 115, 331)
_NUMBERS = (0, 1, -1, 4, 6, 30, 32, 115, 331, 435, 21196, 3e9, -3e9, 1e30, 3e38)
_FLOATS = (*map(float, _NUMBERS), math.nan, math.inf, -math.inf)
_BYTES = (0, 1, 127, 128, 255)
_PACKETS = 1500
_LINKS = (LinkKind.ONBOARD, LinkKind.GROUND_STATION)


def _frame(rng: np.random.Generator, message_id: int, *, about_intervals: bool = False) -> bytes:
    """MAVLink 2, https://mavlink.io/en/guide/serialization.html, from anybody."""
    kind = dialect.mavlink_map[message_id]
    payload = _payload(rng, kind)
    if about_intervals:
        payload = _about_intervals(rng, kind, payload)
    head = struct.pack("<BBBBBB", len(payload), 0, 0, 0, *rng.integers(1, 256, 2).tolist())
    body = head + message_id.to_bytes(3, "little") + payload
    crc = dialect.x25crc(body)
    crc.accumulate(bytes([kind.crc_extra]))
    return b"\xfd" + body + struct.pack("<H", crc.crc)


def _payload(rng: np.random.Generator, kind: type) -> bytes:
    """Bytes of any value; floats and addresses often such as are taken seriously."""
    size = kind.unpacker.size  # type: ignore[attr-defined]
    payload = bytearray(rng.bytes(size))
    if rng.random() < 0.3:
        payload = bytearray(rng.choice(_BYTES, size).astype(np.uint8).tobytes())
    offsets = _offsets(kind)
    if rng.random() < 0.7:
        for offset, code in offsets.values():
            if code == "f":
                struct.pack_into("<f", payload, offset, rng.choice(_FLOATS))
    if rng.random() < 0.9:
        for name, values in (
            ("target_system", (0, 1)),
            ("target_component", (0, 1, 240)),
            ("command", _COMMANDS),
        ):
            if name in offsets:
                offset, code = offsets[name]
                struct.pack_into(f"<{code}", payload, offset, int(rng.choice(values)))
    if "param_id" in offsets and rng.random() < 0.7:
        name = rng.choice(("MC_ROLL_P", "COM_OBL_RC_ACT", "COM_OF_LOSS_T", "MPC_THR_HOVER"))
        struct.pack_into("<16s", payload, offsets["param_id"][0], str(name).encode())
    return bytes(payload)


def _about_intervals(rng: np.random.Generator, kind: type, payload: bytes) -> bytes:
    """The same as a command that sets the interval of a stream, or asks for it.

    What one such packet sets, only another one brings to light.
    """
    changed = bytearray(payload)
    offsets = _offsets(kind)
    struct.pack_into("<f", changed, offsets["param1"][0], rng.choice(_STREAMS))
    struct.pack_into("<H", changed, offsets["command"][0], rng.choice(_INTERVAL_COMMANDS))
    return bytes(changed)


def _offsets(kind: type) -> dict[str, tuple[int, str]]:
    """Where each field begins, by name, and its format of `struct` (of one element)."""
    offsets: dict[str, tuple[int, str]] = {}
    begin = 0
    for name, code, length in zip(
        kind.ordered_fieldnames,  # type: ignore[attr-defined]
        (code for code in kind.native_format.decode() if code != "<"),  # type: ignore[attr-defined]
        kind.array_lengths,  # type: ignore[attr-defined]
        strict=True,
    ):
        offsets[name] = (begin, code)
        begin += struct.calcsize(f"<{code}") * max(1, length)
    return offsets


def _numbers(value: object) -> Iterator[float]:
    if isinstance(value, tuple | list):
        for item in value:
            yield from _numbers(item)
    else:
        assert isinstance(value, int | float)
        yield value


@pytest.mark.parametrize("airborne_at_enu_m", [None, (0.0, 0.0, 200.0)])
def test_random_packets_neither_end_it_nor_make_its_state_infinite(
    airborne_at_enu_m: tuple[float, float, float] | None,
) -> None:
    rng = np.random.default_rng(7)
    shim = Shim(ShimOptions(airborne_at_enu_m=airborne_at_enu_m), _LINKS)
    for _ in range(120):
        shim.step()
    parsers = [Parser() for _ in _LINKS]
    answered: set[str] = set()
    for _ in range(_PACKETS):
        about_intervals = bool(rng.random() < 0.2)
        message_id = int(rng.choice(_COMMAND_IDS if about_intervals else _IDS))
        frame = _frame(rng, message_id, about_intervals=about_intervals)
        shim.receive(int(rng.integers(len(_LINKS))), frame, shim.time_s)
        for _, link, data in shim.step():
            answered |= {message.get_type() for message in parsers[link].parse(data)}
        simulation = shim.simulation
        state = astuple(simulation.state), astuple(simulation.estimate)
        assert all(map(math.isfinite, _numbers(state)))
    assert answered >= {
        "COMMAND_ACK",
        "MESSAGE_INTERVAL",
        "PARAM_VALUE",
        "PARAM_ERROR",
        "FILE_TRANSFER_PROTOCOL",
        "TIMESYNC",
        "PING",
    }
