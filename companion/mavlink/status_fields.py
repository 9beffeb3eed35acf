"""What the flight needs of the messages in which an autopilot tells how it is.

They come some twenty times a second, and of each a field or two is wanted: read from the payload's
bytes that takes a tenth of the time that a message object does.  Field order is that of the wire
(https://mavlink.io/en/messages/common.html); what MAVLink 2 has cut off at the end is zeros.
"""

import struct
from typing import NamedTuple

from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId

_CURRENT_MODE = struct.Struct("<I")
_SYS_STATUS = struct.Struct("<3I18xb")
_EXTENDED_SYS_STATE = struct.Struct("<xB")
_EKF_STATUS_REPORT = struct.Struct("<20xH")
_ESTIMATOR_STATUS = struct.Struct("<40xH")
_EKF_ID = int(MessageId.EKF_STATUS_REPORT)


class Sensors(NamedTuple):
    """Of a SYS_STATUS."""

    present: int
    """Mask of MAV_SYS_STATUS_SENSOR, as the next two."""
    enabled: int
    healthy: int
    battery_percent: int
    """-1 if the autopilot does not know it."""


def current_mode(frame: Frame) -> int:
    """The `custom_mode` of a CURRENT_MODE."""
    return int(_read(_CURRENT_MODE, frame)[0])


def sensors(frame: Frame) -> Sensors:
    """The masks and the battery of a SYS_STATUS."""
    return Sensors(*_read(_SYS_STATUS, frame))


def landed_state(frame: Frame) -> int:
    """MAV_LANDED_STATE of an EXTENDED_SYS_STATE."""
    return int(_read(_EXTENDED_SYS_STATE, frame)[0])


def estimator_flags(frame: Frame) -> int:
    """The flags of an EKF_STATUS_REPORT or an ESTIMATOR_STATUS: they are the same."""
    layout = _EKF_STATUS_REPORT if frame.message_id == _EKF_ID else _ESTIMATOR_STATUS
    return int(_read(layout, frame)[0])


def _read(layout: struct.Struct, frame: Frame) -> tuple[int, ...]:
    payload = frame.payload
    if len(payload) < layout.size:
        payload = payload.ljust(layout.size, b"\0")
    return layout.unpack_from(payload)
