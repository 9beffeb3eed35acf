"""Target: everything of the simulated vehicle that reads its links, in both flavours.

An input is a simulation of some seconds from its boot on; its packets are answers and questions of
a client, which carries on what it has begun where the vehicle asks for more.
"""

import math
import random
import struct
from collections.abc import Iterator
from dataclasses import astuple
from pathlib import Path

from sitl_shim.mavlink.endpoint import Shim
from sitl_shim.mavlink.event_messages import REQUEST_ID
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.simulation import ShimOptions
from tools.fuzz.memory import check_small
from tools.fuzz.packets import PacketSource, Sender, captured
from tools.fuzz.records import Record, join, split
from tools.fuzz.target import FindingError

_LINKS = (LinkKind.ONBOARD, LinkKind.GROUND_STATION)
_PACKETS = 2400
_MOST_RECORDS = 20_000
_MOST_TICKS = 20_000
_KEY = bytes(range(32))
_TICK_US = 4000
_POSES = {"EKF2_EV_CTRL": 15.0, "EKF2_GPS_CTRL": 0.0, "EKF2_HGT_REF": 3.0}
_READ = (
    *(0, 4, 11, 20, 21, 23, 39, 40, 43, 44, 45, 47, 51, 41, 73, 66, 75, 76, 76, 76, 82, 82, 84, 86),
    *(110, 110, 111, 117, 119, 121, 122, 331, 331, REQUEST_ID, 69, 70, 132, 102, 138, 253),
)
_LIKELY: dict[str, tuple[float, ...]] = {
    "target_system": (1, 1, 1, 1, 0, 2),
    "target_component": (1, 1, 1, 0, 240),
    "command": (
        *(16, 20, 21, 22, 84, 176, 178, 192, 224, 246, 300, 400, 400, 410, 510, 511, 511, 512),
        *(519, 520, 521, 176, 241, 193, 183, 42000),
    ),
    "mission_type": (0, 0, 0, 1, 2, 255),
    "seq": (0, 1, 2, 3, 65535),
    "count": (0, 1, 1, 2, 4, 65535),
    "frame": (0, 2, 3, 3, 6),
    "frame_id": (1, 4, 20, 21),
    "estimator_type": (0, 1, 2, 3),
    "coordinate_frame": (0, 1, 3, 5, 6, 7, 8, 9),
    "param_index": (-1, 0, 1, 5, 30000),
    "type": (0, 3, 6, 15, 18),
    "custom_mode": (0, 4, 5, 6, 9, 17, 0x00060000, 0x04030000),
    "type_mask": (7, 7, 128, 0, 3576, 3527),
    "id": (0, 1, 2),
    "ofs": (0, 90, 100_000, 4294967295),
    "req_stream_id": (0, 1, 2, 6, 10, 12),
    "req_message_rate": (0, 1, 4, 50, 65535),
    "first_sequence": (0, 1, 65530),
    "last_sequence": (0, 2, 65535),
    "thrust": (0.0, 0.5, 1.0),
    "param2": (0, 1, 4, 6, 21196, 100000, -1),
    "param1": (0, 1, 30, 32, 115, 331, 245, 148, 410),
}
_NAMES = (
    *(b"MC_ROLL_P", b"COM_OBL_RC_ACT", b"COM_OF_LOSS_T", b"MPC_THR_HOVER", b"SYSID_THISMAV"),
    *(b"GUID_TIMEOUT", b"FS_GCS_ENABLE", b"EKF2_EV_CTRL", b"MAV_SYS_ID", b"WP_YAW_BEHAVIOR"),
)
_PATHS = (
    b"/", b"@PARAM/param.pck", b"@PARAM/param.pck?withdefaults=1&start=5", b"/log/..", b"@SYS",
    b"/log/2026-01-01/00_00_02.ulg", b"/APM/LOGS/00000001.BIN", b"\xff\xfe", b"/fs/../../etc/x",
)  # fmt: skip


class ShimMavlink:
    """See the module."""

    unit = "packets"

    def __init__(self, captures: Path) -> None:
        """Prepare.

        Args:
            captures: folder of captured telemetry.
        """
        self._packets = PacketSource(_READ, _LIKELY, captured(captures))

    # --- inputs ---

    def generate(self, rng: random.Random) -> bytes:
        """A simulation with 2,400 packets."""
        header = bytes((rng.randrange(256), rng.randrange(256), 0, 0))
        key = _KEY if header[0] & 12 == 12 else None
        client, others = Sender(1, 190, key), Sender(255, 190, rng.choice((None, key)))
        records = []
        for _ in range(_PACKETS):
            records.append(
                Record(rng.randrange(2), rng.choice((0, 0, 0, 1)), self._one(rng, client, others))
            )
        records.append(Record(0, 20, b""))
        return join(header, records)

    def mutate(self, data: bytes, rng: random.Random) -> bytes:
        """Records left out, doubled, made anew."""
        header, records = split(data)
        for _ in range(rng.choice((1, 2, 4))):
            at = rng.randrange(len(records) + 1)
            match rng.randrange(4):
                case 0:
                    records = records[:at] + records[at + 1 :]
                case 1:
                    records[at:at] = records[at : at + 1]
                case 2:
                    header = rng.randbytes(4)
                case _:
                    made = self._one(rng, Sender(1, 190), Sender(255, 190))
                    records.insert(at, Record(rng.randrange(2), rng.choice((0, 1, 5)), made))
        return join(header, records)

    def pieces(self, data: bytes) -> list[bytes]:
        """Header and records."""
        header, records = split(data)
        return [header, *(join(b"", [record])[4:] for record in records)]

    def join(self, pieces: list[bytes]) -> bytes:
        """The input of these."""
        return b"".join(pieces)

    def _one(self, rng: random.Random, client: Sender, others: Sender) -> bytes:
        chance = rng.random()
        if chance < 0.0004:
            return _key_change(client, rng)
        if chance < 0.04:
            return client.pack(110, _file_request(rng))
        if chance < 0.08:
            return client.pack(*_named(rng))
        if chance < 0.12:
            return client.pack(82, _level(rng))
        return self._packets.packet(rng, client, others)

    # --- running ---

    def run(self, data: bytes) -> int:
        """Simulate an input from the boot on."""
        header, records = split(data)
        records = records[:_MOST_RECORDS]
        shim = _booted(header)
        partner = Sender(1, 190, _KEY if header[0] & 12 == 12 else None)
        ticks = 0
        for number, record in enumerate(records):
            for _ in range(record.wait % 64):
                if ticks < _MOST_TICKS:
                    for _, link, sent in shim.step():
                        answer = _carried_on(sent, partner)
                        if answer:
                            shim.receive(link, answer, shim.time_s)
                    ticks += 1
            shim.receive(record.kind & 1, record.data, shim.time_s)
            if number % 64 == 0:
                _check(shim)
        for _ in range(20):
            shim.step()
        _check(shim)
        if header[1] & 3 == 0:
            check_small([shim], ("sitl_shim", "pymavlink"), most_items=2500, most_bytes=4_100_000)
        return max(1, len(records))


def _booted(header: bytes) -> Shim:
    """A vehicle as the header chooses it, that has just begun to listen."""
    ardupilot = bool(header[0] & 1)
    poses = header[0] & 0x30 == 0x30 and not ardupilot
    options = ShimOptions(
        autopilot="ardupilot" if ardupilot else "px4",
        airborne_at_enu_m=(0.0, 0.0, 60.0) if header[0] & 2 else None,
        boot_scale=0.02,
        parameters=_POSES if poses else {},
        signing_key=_KEY if header[0] & 12 == 12 else None,
    )
    shim = Shim(options, _LINKS)
    while shim.simulation.time_us < shim.personality.listens_from_us + _TICK_US:
        shim.step()
    return shim


def _check(shim: Shim) -> None:
    simulation = shim.simulation
    state = (astuple(simulation.state), astuple(simulation.estimate))
    if not all(map(math.isfinite, _numbers(state))):
        raise FindingError(f"the vehicle's state is not finite: {state}")


def _numbers(value: object) -> Iterator[float]:
    if isinstance(value, tuple | list):
        for item in value:
            yield from _numbers(item)
    elif isinstance(value, int | float):
        yield value


def _file_request(rng: random.Random) -> bytes:
    """FILE_TRANSFER_PROTOCOL: network, system, component, then the header of a request."""
    opcode = rng.choice((0, 1, 2, 3, 4, 4, 5, 14, 15, 15, 7, rng.randrange(256)))
    path = rng.choice(_PATHS) if opcode in (3, 4, 14) else b""
    size = len(path) if path else rng.choice((0, 1, 239, 255))
    head = (
        rng.randrange(65536).to_bytes(2, "little")
        + bytes((rng.choice((0, 1, 3, 200)), opcode, size, 0, 0, 0))
        + rng.choice((0, 1, 300, 2**32 - 1)).to_bytes(4, "little")
    )
    return b"\x00\x01\x01" + (head + path).ljust(248, b"\0")


def _named(rng: random.Random) -> tuple[int, bytes]:
    """PARAM_SET or PARAM_REQUEST_READ with a name that there is."""
    name = rng.choice(_NAMES).ljust(16, b"\0")[:16]
    if rng.random() < 0.4:
        return 20, rng.choice((b"\xff\xff", b"\x05\x00", b"\xfe\xff")) + b"\x01\x01" + name
    value = rng.choice((bytes(4), b"\x00\x00\x80\x3f", b"\x00\x00\xc0\x7f", rng.randbytes(4)))
    return 23, value + b"\x01\x01" + name + bytes((rng.choice((9, 6, 4, 0, 255)),))


def _key_change(client: Sender, rng: random.Random) -> bytes:
    """SETUP_SIGNING, to the one key or to none; what comes later is signed accordingly."""
    key = rng.choice((_KEY, None))
    payload = (1 << 44).to_bytes(8, "little") + b"\x01\x01" + (key or bytes(32))
    packet = client.pack(256, payload)
    client.key = key
    return packet


def _carried_on(sent: bytes, partner: Sender) -> bytes:
    """What lets a transfer of a mission go on that the vehicle has begun; empty for all else."""
    if sent[0] != 0xFD or sent[7] not in (40, 44, 51) or sent[8] or sent[9]:
        return b""
    payload = sent[10 : 10 + sent[1]].ljust(8, b"\0")
    if sent[7] == 44:  # MISSION_COUNT: ask for the first
        return partner.pack(51, bytes((0, 0, 1, 1, payload[4])))
    kind = payload[4] % 3
    command = (16, 5001, 5100)[kind]
    item = struct.pack("<4fiif", 0, 1, 0, 0, 473977418, 85455938, 5.0)
    item += payload[:2] + command.to_bytes(2, "little") + bytes((1, 1, 3, 0, 1, kind))
    return partner.pack(73, item)


def _level(rng: random.Random) -> bytes:
    """SET_ATTITUDE_TARGET that an autopilot obeys."""
    thrust = rng.choice((0.0, 0.3, 0.5, 0.9))
    mask = rng.choice((7, 128))
    return struct.pack("<I4f3ffBBB", 0, 1.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, thrust, 1, 1, mask)
