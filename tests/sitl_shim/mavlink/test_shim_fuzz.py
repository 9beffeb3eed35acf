"""Whatever comes in with a right checksum, the shim goes on and stays finite."""

import math
import struct
from collections import deque
from collections.abc import Iterator
from dataclasses import astuple
from typing import Any

import numpy as np
import pytest

from sitl_shim.mavlink.endpoint import Shim
from sitl_shim.mavlink.event_messages import REQUEST_ID
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Packer, Parser, dialect
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
    "REQUEST_DATA_STREAM",
    "SET_POSITION_TARGET_LOCAL_NED",
    "SET_POSITION_TARGET_GLOBAL_INT",
    "MISSION_COUNT",
    "MISSION_ITEM",
    "MISSION_ITEM_INT",
    "MISSION_REQUEST",
    "MISSION_REQUEST_INT",
    "MISSION_REQUEST_LIST",
    "MISSION_ACK",
    "MISSION_SET_CURRENT",
    "MISSION_CLEAR_ALL",
    "LOG_REQUEST_LIST",
    "LOG_REQUEST_DATA",
    "LOG_REQUEST_END",
    "LOG_ERASE",
    "ODOMETRY",
    "SETUP_SIGNING",
)
_NOT_READ = ("PARAM_VALUE", "MISSION_CURRENT", "LOG_DATA")
_IDS = [getattr(dialect, f"MAVLINK_MSG_ID_{name}") for name in _READ + _NOT_READ]
_COMMAND_IDS = _IDS[2:4]
_ODOMETRY = _IDS[_READ.index("ODOMETRY")]
_MISSION_IDS = _IDS[_READ.index("MISSION_COUNT") : _READ.index("MISSION_ACK")]
_COMMANDS = (
    *(16, 20, 21, 22, 84, 176, 178, 192, 224, 246, 300, 400, 410),
    *(510, 511, 512, 519, 520, 521),
)
_INTERVAL_COMMANDS = (510, 511)
_STREAMS = (30, 115, 331)
_NUMBERS = (0, 1, -1, 4, 6, 30, 32, 115, 331, 435, 21196, 3e9, -3e9, 1e30, 3e38)
_FLOATS = (*map(float, _NUMBERS), math.nan, math.inf, -math.inf)
_BYTES = (0, 1, 127, 128, 255)
_PACKETS = 2500
_MISSION_COMMANDS = (16, 17, 19, 20, 21, 22, 93, 177, 178, 5001, 5100)
_FILES = (b"/", b"@PARAM/param.pck?withdefaults=1", b"/log/2026-01-01/00_00_02.ulg", b"/log/..")
_LINKS = (LinkKind.ONBOARD, LinkKind.GROUND_STATION)


class _RequestEvent:
    """REQUEST_EVENT, described as pymavlink describes the messages it knows."""

    msgname = "REQUEST_EVENT"
    crc_extra = 33
    unpacker = struct.Struct("<HHBB")
    native_format = b"<HHBB"
    ordered_fieldnames = ("first_sequence", "last_sequence", "target_system", "target_component")
    array_lengths = (0, 0, 0, 0)


_KINDS: dict[int, type] = {REQUEST_ID: _RequestEvent}
_IDS.append(REQUEST_ID)


def _frame(rng: np.random.Generator, message_id: int, *, about_intervals: bool = False) -> bytes:
    """MAVLink 2, https://mavlink.io/en/guide/serialization.html, from anybody."""
    kind = _KINDS.get(message_id) or dialect.mavlink_map[message_id]
    payload = _payload(rng, kind)
    if about_intervals:
        payload = _about_intervals(rng, kind, payload)
    # Often the same sender, so that what it begins can go on.
    sender = (1, 190) if rng.random() < 0.8 else rng.integers(1, 256, 2).tolist()
    head = struct.pack("<BBBBBB", len(payload), 0, 0, 0, *sender)
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
    for name, values in _LIKELY.get(kind.msgname, ()):  # type: ignore[attr-defined]
        if rng.random() < 0.9:
            offset, code = offsets[name]
            struct.pack_into(f"<{code}", payload, offset, int(rng.choice(values)))
    if kind.msgname == "FILE_TRANSFER_PROTOCOL":  # type: ignore[attr-defined]
        _about_files(rng, payload)
    if "param_id" in offsets and rng.random() < 0.7:
        name = rng.choice(("MC_ROLL_P", "COM_OBL_RC_ACT", "COM_OF_LOSS_T", "MPC_THR_HOVER"))
        struct.pack_into("<16s", payload, offsets["param_id"][0], str(name).encode())
    return bytes(payload)


_TYPES = ("mission_type", (0, 0, 0, 1, 2))
_ITEM = (("seq", (0, 1, 2)), ("frame", (3, 3, 6, 0, 2)), ("command", _MISSION_COMMANDS), _TYPES)
_LIKELY: dict[str, tuple[tuple[str, tuple[int, ...]], ...]] = {
    "MISSION_COUNT": (("count", (0, 1, 1, 2)), _TYPES),
    "MISSION_REQUEST_LIST": (_TYPES,),
    "MISSION_REQUEST": (("seq", (0, 1, 2)), _TYPES),
    "MISSION_REQUEST_INT": (("seq", (0, 1, 2)), _TYPES),
    "MISSION_ACK": (("type", (0, 3, 15)), _TYPES),
    "MISSION_SET_CURRENT": (("seq", (0, 1, 2)),),
    "MISSION_ITEM": (*_ITEM, ("x", (0, 47)), ("y", (0, 8))),
    "MISSION_ITEM_INT": (*_ITEM, ("x", (0, 473977418)), ("y", (0, 85455938))),
    "LOG_REQUEST_LIST": (("start", (0, 1)), ("end", (0, 65535))),
    "LOG_REQUEST_DATA": (("id", (0, 1)), ("ofs", (0, 90, 100_000))),
    "SET_POSITION_TARGET_LOCAL_NED": (("coordinate_frame", (1, 7, 8, 9)),),
    "ODOMETRY": (("frame_id", (1, 4, 20, 21)), ("estimator_type", (0, 1, 2, 3)), ("quality", (0,))),
    "REQUEST_EVENT": (("first_sequence", (0, 1, 65530)), ("last_sequence", (0, 2, 65535))),
    "SET_POSITION_TARGET_GLOBAL_INT": (("coordinate_frame", (0, 3, 5, 6)),),
}
"""Values with which a message is taken seriously."""


def _about_files(rng: np.random.Generator, payload: bytearray) -> None:
    """Make a request of it that leads somewhere: header after network, system, component."""
    opcode = int(rng.choice((0, 1, 2, 3, 4, 4, 5, 14, 15, 15, 7)))
    path = rng.choice(np.array(_FILES, dtype=object)) if opcode in (3, 4, 14) else b""
    size = len(path) if path else int(rng.choice((0, 1, 239, 255)))
    offset = int(rng.choice((0, 1, 300, 2**32 - 1)))
    session = int(rng.choice((0, 1, 3, 200)))
    head = struct.pack("<HBBBBBxI", int(rng.integers(65536)), session, opcode, size, 0, 0, offset)
    payload[3 : 3 + len(head) + len(path)] = head + path


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


_POSES_ONLY = {"EKF2_EV_CTRL": 15.0, "EKF2_GPS_CTRL": 0.0, "EKF2_HGT_REF": 3.0}


@pytest.mark.parametrize(
    ("autopilot", "parameters"), [("px4", {}), ("px4", _POSES_ONLY), ("ardupilot", {})]
)
@pytest.mark.parametrize("airborne_at_enu_m", [None, (0.0, 0.0, 200.0)])
def test_random_packets_neither_end_it_nor_make_its_state_infinite(
    autopilot: str,
    parameters: dict[str, float],
    airborne_at_enu_m: tuple[float, float, float] | None,
) -> None:
    rng, rng_of_poses = np.random.default_rng(7), np.random.default_rng(8)
    options = ShimOptions(
        autopilot=autopilot,
        airborne_at_enu_m=airborne_at_enu_m,
        boot_scale=0.02,
        parameters=parameters,
    )
    shim = Shim(options, _LINKS)
    for _ in range(525):
        shim.step()
    parsers = [Parser() for _ in _LINKS]
    answered: set[str] = set()
    partner = Packer(1, 190)
    wire = _Wire(shim)
    keys = 0
    for _ in range(_PACKETS):
        about_intervals = bool(rng.random() < 0.2)
        ids = _MISSION_IDS if rng.random() < 0.4 else _IDS
        message_id = int(rng.choice(_COMMAND_IDS if about_intervals else ids))
        frame = _frame(rng, message_id, about_intervals=about_intervals)
        wire.send(int(rng.integers(len(_LINKS))), frame)
        if parameters and rng_of_poses.random() < 0.4:
            wire.send(0, _frame(rng_of_poses, _ODOMETRY))
        for _, link, data in shim.step():
            for message in parsers[link].parse(data):
                answered.add(message.get_type())
                going_on = _what_it_waits_for(message, as_int=bool(rng.random() < 0.5))
                if going_on is not None and rng.random() < 0.95:
                    wire.send(link, partner.pack(going_on))
        if shim.signing.key is not None and rng.random() < 0.5:
            keys += 1
            wire.send(0, _no_key(shim))
        simulation = shim.simulation
        state = astuple(simulation.state), astuple(simulation.estimate)
        assert all(map(math.isfinite, _numbers(state)))
    assert not parameters or shim.simulation._estimator.resets > 0, "poses were fused"
    assert (keys > 0) is (airborne_at_enu_m is None), "none is taken while armed"
    assert answered >= {
        "COMMAND_ACK",
        "MESSAGE_INTERVAL",
        "PARAM_VALUE",
        "FILE_TRANSFER_PROTOCOL",
        "TIMESYNC",
        "PING",
        "MISSION_ACK",
        "MISSION_COUNT",
        "MISSION_REQUEST_INT",
        "MISSION_ITEM",
        "MISSION_ITEM_INT",
        "LOG_ENTRY",
        "LOG_DATA",
    }
    assert ("PARAM_ERROR" in answered) is (autopilot == "px4")
    assert shim.simulation.autopilot.mission.revision > 0, "missions came through whole"
    _assert_small(shim)


class _Wire:
    """Brings packets in pieces that end in the middle of another, which says nothing."""

    def __init__(self, shim: Shim) -> None:
        self._shim = shim
        self._held = [b"" for _ in _LINKS]
        nothing = dialect.MAVLink_named_value_int_message(0, b"nothing", 0)
        self._nothing = Packer(1, 190).pack(nothing)

    def send(self, link: int, frame: bytes) -> None:
        data = self._held[link] + frame + self._nothing[:9]
        self._shim.receive(link, data, self._shim.time_s)
        self._held[link] = self._nothing[9:]


def _no_key(shim: Shim) -> bytes:
    """What takes the key from the vehicle again, signed with it."""
    packer = Packer(1, 190)
    packer.sign(shim.signing.key, 7, shim.signing.take_stamp)
    return packer.pack(dialect.MAVLink_setup_signing_message(1, 1, [0] * 32, 0))


def _what_it_waits_for(message: Any, *, as_int: bool) -> Any:
    """What lets a transfer of a mission go on; None if it waits for nothing."""
    kind = message.get_type()
    if kind in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
        command = {0: 16, 1: 5001, 2: 5100}[message.mission_type]
        return dialect.MAVLink_mission_item_int_message(
            1, 1, message.seq, 3, command, 0, 1, 0, 0, 0, 0, 473977418, 85455938, 5.0,
            message.mission_type,
        )  # fmt: skip
    if kind == "MISSION_COUNT":
        request = dialect.MAVLink_mission_request_message
        if as_int:
            request = dialect.MAVLink_mission_request_int_message
        return request(1, 1, 0, message.mission_type)
    return None


def _assert_small(shim: Shim) -> None:
    """Nothing has piled up: all that is kept is small, whoever has asked for however much."""
    seen: set[int] = set()
    waiting: list[object] = [shim]
    while waiting:
        thing = waiting.pop()
        if id(thing) in seen or isinstance(thing, str | int | float | type):
            continue
        seen.add(id(thing))
        if isinstance(thing, bytearray):
            assert len(thing) < 10_000
        elif isinstance(thing, bytes):
            assert len(thing) < 4_100_000
        elif isinstance(thing, dict):
            assert len(thing) < 2000
            waiting += thing.values()
        elif isinstance(thing, list | tuple | deque | set | frozenset):
            assert len(thing) <= 2000
            waiting += thing
        elif type(thing).__module__.startswith(("sitl_shim", "pymavlink")):
            waiting += [getattr(thing, name) for name in _attributes(thing)]
    assert {id(link.parser) for link in shim._links} <= seen


def _attributes(thing: object) -> list[str]:
    slots = [name for kind in type(thing).__mro__ for name in getattr(kind, "__slots__", ())]
    names = [*slots, *getattr(thing, "__dict__", {})]
    return [name for name in names if hasattr(thing, name)]
