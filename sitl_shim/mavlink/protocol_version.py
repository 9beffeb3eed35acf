"""PROTOCOL_VERSION (300), which pymavlink's dialects do not know and PX4 sends.

Fields: version, min_version, max_version (uint16), spec_version_hash and library_version_hash
(8 bytes each); https://mavlink.io/en/messages/common.html#PROTOCOL_VERSION.
"""

import struct

from sitl_shim.mavlink.wire import Message, dialect

MESSAGE_ID = 300
_VERSION, _MINIMUM, _MAXIMUM = 200, 100, 203
_LIBRARY_HASH = bytes.fromhex("7f64b93802fe01b4")


class ProtocolVersion(dialect.MAVLink_message):  # type: ignore[misc]  # pymavlink is untyped
    """The one PROTOCOL_VERSION that PX4 v1.17 sends, ready to pack."""

    crc_extra = 217

    def __init__(self) -> None:
        super().__init__(MESSAGE_ID, "PROTOCOL_VERSION")

    def pack(self, mav: Message, force_mavlink1: bool = False) -> bytes:
        """Pack as the generated messages do."""
        payload = struct.pack("<HHH8s8s", _VERSION, _MINIMUM, _MAXIMUM, bytes(8), _LIBRARY_HASH)
        frame: bytes = self._pack(mav, self.crc_extra, payload, force_mavlink1=force_mavlink1)
        return frame
