"""Messages that the companion sends, as payload bytes, and the numbers of the protocol.

Payload fields are in wire order (https://mavlink.io/en/messages/common.html, largest types
first).  Ids are written out here, so that nothing has to import the dialect for a number.
"""

import struct
from enum import IntEnum
from typing import NamedTuple


class MessageId(IntEnum):
    """The messages that the companion reads or sends."""

    HEARTBEAT = 0
    SYS_STATUS = 1
    PARAM_REQUEST_READ = 20
    PARAM_VALUE = 22
    PARAM_SET = 23
    GPS_RAW_INT = 24
    ATTITUDE = 30
    ATTITUDE_QUATERNION = 31
    LOCAL_POSITION_NED = 32
    GLOBAL_POSITION_INT = 33
    COMMAND_INT = 75
    COMMAND_LONG = 76
    COMMAND_ACK = 77
    SET_ATTITUDE_TARGET = 82
    ATTITUDE_TARGET = 83
    RADIO_STATUS = 109
    TIMESYNC = 111
    HIL_STATE_QUATERNION = 115
    BATTERY_STATUS = 147
    AUTOPILOT_VERSION = 148
    EKF_STATUS_REPORT = 193
    ESTIMATOR_STATUS = 230
    HOME_POSITION = 242
    EXTENDED_SYS_STATE = 245
    DEBUG_VECT = 250
    NAMED_VALUE_FLOAT = 251
    STATUSTEXT = 253
    ODOMETRY = 331
    PARAM_ERROR = 345
    CURRENT_MODE = 436


class VehicleStateOfHealth(IntEnum):
    """MAV_STATE, as heartbeats carry it."""

    UNINIT = 0
    BOOT = 1
    CALIBRATING = 2
    STANDBY = 3
    ACTIVE = 4
    CRITICAL = 5
    EMERGENCY = 6
    POWEROFF = 7


class Severity(IntEnum):
    """MAV_SEVERITY of a STATUSTEXT."""

    EMERGENCY = 0
    ALERT = 1
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


COMPONENT_AUTOPILOT = 1
COMPONENT_ONBOARD_COMPUTER = 191
COMPONENT_TRUTH = 240
"""Component of the simulation that sends the exact truth (ODOMETRY, DEBUG_VECT)."""
AUTOPILOT_INVALID = 8
TYPE_ONBOARD_CONTROLLER = 18
BASE_MODE_ARMED = 0x80
_TEXT_BYTES = 50


class Outgoing(NamedTuple):
    """A message before it gets its header: `codec.Packer.pack` makes the bytes."""

    message_id: int
    payload: bytes


class Target(NamedTuple):
    """Whom a message is for."""

    system_id: int
    component_id: int = COMPONENT_AUTOPILOT


def heartbeat(state: VehicleStateOfHealth) -> Outgoing:
    """HEARTBEAT of an onboard controller (type 18, no autopilot)."""
    return Outgoing(
        MessageId.HEARTBEAT,
        struct.pack("<IBBBBB", 0, TYPE_ONBOARD_CONTROLLER, AUTOPILOT_INVALID, 0, state, 3),
    )


def status_texts(severity: Severity, text: str, text_id: int = 0) -> list[Outgoing]:
    """STATUSTEXT, in chunks of 50 bytes where the text is longer.

    Args:
        severity: how bad it is.
        text: what to say.
        text_id: 1..65535, the same for all chunks of a long text and different from that of
            the long text before; not used for a short one.
    """
    data = text.encode("ascii", errors="replace")
    chunks = [data[i : i + _TEXT_BYTES] for i in range(0, len(data), _TEXT_BYTES)] or [b""]
    if len(chunks) == 1:
        text_id = 0
    elif len(chunks[-1]) == _TEXT_BYTES:
        chunks.append(b"")  # the zero that ends the text must be sent too
    return [
        Outgoing(
            MessageId.STATUSTEXT, struct.pack("<B50sHB", severity, chunk, text_id, number & 0xFF)
        )
        for number, chunk in enumerate(chunks)
    ]
