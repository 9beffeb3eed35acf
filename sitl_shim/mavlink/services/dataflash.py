"""ArduPilot's log format, DataFlash binary: enough of it for a flight's state.

https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html
"""

import math
import struct

from sitl_shim.mavlink.services.flight_record import Record

_HEAD = b"\xa3\x95"
_FORMAT_TYPE = 128
_FORMAT = struct.Struct("<BB4s16s64s")
_FORMAT_BYTES = 3 + _FORMAT.size
_TEXT, _POSITION, _ATTITUDE, _MODE = 129, 130, 131, 132
_TEXT_BODY = struct.Struct("<Q64s")
_POSITION_BODY = struct.Struct("<Q6f")
_ATTITUDE_BODY = struct.Struct("<Q3f")
_MODE_BODY = struct.Struct("<QBB")
_DEFINITIONS = (
    (_FORMAT_TYPE, _FORMAT, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns"),
    (_TEXT, _TEXT_BODY, b"MSG", b"QZ", b"TimeUS,Message"),
    (_POSITION, _POSITION_BODY, b"NKF", b"Qffffff", b"TimeUS,PN,PE,PD,VN,VE,VD"),
    (_ATTITUDE, _ATTITUDE_BODY, b"ATT", b"Qfff", b"TimeUS,Roll,Pitch,Yaw"),
    (_MODE, _MODE_BODY, b"MODE", b"QBB", b"TimeUS,Mode,Armed"),
)


def header(start_us: int) -> bytes:
    """The beginning of a log: the formats, and who wrote it."""
    parts = [
        _message(_FORMAT_TYPE, _FORMAT.pack(kind, 3 + body.size, name, code, columns))
        for kind, body, name, code, columns in _DEFINITIONS
    ]
    parts.append(_message(_TEXT, _TEXT_BODY.pack(start_us, b"ArduCopter V4.7.0-dev")))
    return b"".join(parts)


def row(record: Record) -> bytes:
    """One moment of the flight."""
    at = record.time_us
    attitude = _euler_deg(record.attitude_frd_to_ned)
    return b"".join(
        (
            _message(
                _POSITION,
                _POSITION_BODY.pack(at, *record.position_ned_m, *record.velocity_ned_m_s),
            ),
            _message(_ATTITUDE, _ATTITUDE_BODY.pack(at, *attitude)),
            _message(_MODE, _MODE_BODY.pack(at, record.custom_mode & 0xFF, record.armed)),
        )
    )


def _message(kind: int, body: bytes) -> bytes:
    return _HEAD + bytes([kind]) + body


def _euler_deg(q: tuple[float, float, float, float]) -> tuple[float, float, float]:
    w, x, y, z = q
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return math.degrees(roll), math.degrees(pitch), math.degrees(yaw) % 360.0
