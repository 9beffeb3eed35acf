"""PX4's log format, ULog: enough of it for a flight's state.

https://docs.px4.io/main/en/dev_log/ulog_file_format
"""

import struct

from sitl_shim.mavlink.services.flight_record import Record

_MAGIC = b"ULog\x01\x12\x35\x01"
_FORMATS = (
    "vehicle_local_position:uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;",
    "vehicle_attitude:uint64_t timestamp;float[4] q;",
    "vehicle_status:uint64_t timestamp;uint8_t nav_state;uint8_t arming_state;",
    "actuator_outputs:uint64_t timestamp;float[4] output;",
)
_SUBSCRIPTIONS = (
    "vehicle_local_position",
    "vehicle_attitude",
    "vehicle_status",
    "actuator_outputs",
)
_PAYLOADS = ("Q6f", "Q4f", "QBB", "Q4f")
"""Of the subscriptions, in their order."""
_ROW = struct.Struct("<" + "".join(f"5s{payload}" for payload in _PAYLOADS))
_STANDBY, _ARMED = 1, 2
_NAVIGATION_STATES = {0x00: 0, 0x02: 1, 0x03: 2, 0x05: 10, 0x06: 14, 0x07: 15}
_AUTO = 0x04
_AUTO_NAVIGATION_STATES = {2: 17, 3: 4, 4: 3, 5: 5, 6: 18}
"""vehicle_status.nav_state by main mode and, for AUTO, by sub mode."""


def header(start_us: int) -> bytes:
    """The beginning of a log: magic, flags, definitions, subscriptions."""
    parts = [_MAGIC, struct.pack("<Q", start_us), _message("B", bytes(40))]
    parts += [_message("F", text.encode()) for text in _FORMATS]
    parts.append(_information("char[4] sys_name", b"PX4\0"[:4]))
    parts.append(_information("char[9] ver_hw", b"SITL_SHIM"))
    for index, name in enumerate(_SUBSCRIPTIONS):
        parts.append(_message("A", struct.pack("<BH", 0, index) + name.encode()))
    return b"".join(parts)


def row(record: Record) -> bytes:
    """One moment of the flight."""
    at = record.time_us
    state = _ARMED if record.armed else _STANDBY
    position, attitude, status, outputs = _HEADS
    return _ROW.pack(
        position,
        at,
        *record.position_ned_m,
        *record.velocity_ned_m_s,
        attitude,
        at,
        *record.attitude_frd_to_ned,
        status,
        at,
        _navigation_state(record.custom_mode),
        state,
        outputs,
        at,
        *record.rotor_commands,
    )


def _navigation_state(custom_mode: int) -> int:
    main, sub = (custom_mode >> 16) & 0xFF, custom_mode >> 24
    if main == _AUTO:
        return _AUTO_NAVIGATION_STATES.get(sub, 4)
    return _NAVIGATION_STATES.get(main, 0)


def _information(key: str, value: bytes) -> bytes:
    return _message("I", bytes([len(key)]) + key.encode() + value)


def _message(kind: str, payload: bytes) -> bytes:
    return struct.pack("<Hc", len(payload), kind.encode()) + payload


_HEADS = tuple(
    struct.pack("<HcH", 2 + struct.calcsize(f"<{payload}"), b"D", index)
    for index, payload in enumerate(_PAYLOADS)
)
"""What stands before each payload: its length, that it is data, its subscription."""
