"""The few fields of MAVLink frames that tell which setpoint answers which state.

https://mavlink.io/en/guide/serialization.html and the pages of the messages.
"""

import struct
from collections.abc import Iterator

_MAGIC = 0xFD
_HEADER = 10
_CHECKSUM, _SIGNATURE = 2, 13
_SIGNED = 0x01
_AUTOPILOT = 1
_ODOMETRY = 331
_SET_ATTITUDE_TARGET = 82
_TIME_USEC = struct.Struct("<Q")
_TIME_MS = struct.Struct("<I")
_THRUST = struct.Struct("<f")
_THRUST_AT = 32

TAGS = 4096
"""A thrust tells its state's time modulo so many ms, where a client sends no such time."""


def sample_times_ms(datagram: bytes) -> Iterator[int]:
    """Times since boot of the states (ODOMETRY of the autopilot) in a datagram, ms."""
    for component, message, payload in _frames(datagram):
        if message == _ODOMETRY and component == _AUTOPILOT:
            yield round(_TIME_USEC.unpack_from(payload.ljust(_TIME_USEC.size, b"\0"))[0] / 1000)


def setpoint_times_ms(datagram: bytes) -> Iterator[int]:
    """`time_boot_ms` of the setpoints (SET_ATTITUDE_TARGET) in a datagram: their states', ms."""
    for _, message, payload in _frames(datagram):
        if message == _SET_ATTITUDE_TARGET:
            yield _TIME_MS.unpack_from(payload)[0]


def setpoint_tags(datagram: bytes) -> Iterator[int]:
    """The times of the setpoints' states modulo `TAGS`, as `tagged_thrust` hides them."""
    for _, message, payload in _frames(datagram):
        if message == _SET_ATTITUDE_TARGET:
            yield int(_THRUST.unpack_from(payload, _THRUST_AT)[0] * 2 * TAGS)


def tagged_thrust(time_usec: int) -> float:
    """A thrust below 0.5 that tells a state's time."""
    return (round(time_usec / 1000) % TAGS + 0.5) / (2 * TAGS)


def _frames(datagram: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Sender's component, message id and payload of each whole MAVLink 2 frame."""
    at = 0
    while at + _HEADER + _CHECKSUM <= len(datagram) and datagram[at] == _MAGIC:
        length = datagram[at + 1]
        end = at + _HEADER + length
        yield (
            datagram[at + 6],
            int.from_bytes(datagram[at + 7 : at + 10], "little"),
            datagram[at + _HEADER : end],
        )
        at = end + _CHECKSUM + (_SIGNATURE if datagram[at + 2] & _SIGNED else 0)
