"""The one module that imports pymavlink's generated dialect (which takes half a second).

The dialect is `all`: `common` lacks CURRENT_MODE, AVAILABLE_MODES and EKF_STATUS_REPORT.
"""

from typing import Any

from pymavlink.dialects.v20 import all as _dialect

Message = Any
"""A message object of pymavlink's generated dialect; its fields are attributes."""

MAVLink: Any = _dialect.MAVLink
"""pymavlink's own parser and packer, for what is seldom done."""

MESSAGE_CLASSES: dict[int, Any] = dict(_dialect.mavlink_map)
"""Generated class of each message id that the dialect knows."""

CRC_EXTRA: dict[int, int] = {
    message_id: int(message_class.crc_extra)
    for message_id, message_class in MESSAGE_CLASSES.items()
}
"""Seed that closes the CRC of each known id (https://mavlink.io/en/guide/serialization.html)."""

CRC_EXTRA_UNDECODABLE: dict[int, int] = {
    8: 117,  # LINK_NODE_STATUS
    300: 217,  # PROTOCOL_VERSION
    380: 232,  # TIME_ESTIMATE_TO_TARGET
    395: 0,  # COMPONENT_INFORMATION
    397: 182,  # COMPONENT_METADATA
    410: 160,  # EVENT
    411: 106,  # CURRENT_EVENT_SEQUENCE
}
"""The same for ids that PX4 sends and the dialect lacks, solved from a real PX4's packets."""


def message_name(message_id: int) -> str:
    """Name of a message, or its number where the dialect does not know it."""
    message_class = MESSAGE_CLASSES.get(message_id)
    return f"message {message_id}" if message_class is None else str(message_class.msgname)


def message_class(name: str) -> Any:  # noqa: ANN401 - pymavlink is untyped
    """Generated class of a message name such as ``"HEARTBEAT"``.

    Raises:
        KeyError: the dialect has no such message.
    """
    found = getattr(_dialect, f"MAVLink_{name.lower()}_message", None)
    if found is None:
        raise KeyError(f"the MAVLink dialect has no message named {name!r}")
    return found
