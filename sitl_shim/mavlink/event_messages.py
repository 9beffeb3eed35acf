"""Messages of the events interface (410 to 413), which pymavlink's dialects do not know.

Layouts and checksum seeds follow from https://mavlink.io/en/messages/common.html#EVENT; the seeds
were checked against recorded packets.
"""

import struct
from typing import Any

from pymavlink.dialects.v20 import all as dialect

Untyped = Any
"""What pymavlink hands out."""
EVENT_ID, SEQUENCE_ID, REQUEST_ID, ERROR_ID = 410, 411, 412, 413
_SEEDS = {EVENT_ID: 160, SEQUENCE_ID: 106, REQUEST_ID: 33, ERROR_ID: 77}
_EVENT = struct.Struct("<IIHBBB40s")
_SEQUENCE = struct.Struct("<HB")
_REQUEST = struct.Struct("<HHBB")
_ERROR = struct.Struct("<HHBBB")
_HEADER_BYTES = 10
_SYSTEM_AT = 5
_ARGUMENT_BYTES = 40


class _Packable(dialect.MAVLink_message):  # type: ignore[misc]  # pymavlink is untyped
    """A message that packs as the generated ones do."""

    def __init__(self, message_id: int, name: str, payload: bytes) -> None:
        super().__init__(message_id, name)
        self._content = payload

    def pack(self, mav: Untyped, force_mavlink1: bool = False) -> bytes:
        """Pack as the generated messages do."""
        seed = _SEEDS[self.get_msgId()]
        frame: bytes = self._pack(mav, seed, self._content, force_mavlink1=force_mavlink1)
        return frame


def event_message(
    event_id: int, time_ms: int, sequence: int, levels: int, arguments: bytes
) -> _Packable:
    """EVENT (410) to everybody.

    Args:
        event_id: of the event.
        time_ms: of boot.
        sequence: of the event, 0..65535.
        levels: log levels, internal and external.
        arguments: at most 40 bytes.
    """
    filled = arguments[:_ARGUMENT_BYTES].ljust(_ARGUMENT_BYTES, b"\0")
    payload = _EVENT.pack(event_id, time_ms, sequence, 0, 0, levels, filled)
    return _Packable(EVENT_ID, "EVENT", payload)


def current_sequence_message(sequence: int) -> _Packable:
    """CURRENT_EVENT_SEQUENCE (411)."""
    return _Packable(SEQUENCE_ID, "CURRENT_EVENT_SEQUENCE", _SEQUENCE.pack(sequence, 0))


def error_message(sequence: int, oldest: int, target: tuple[int, int]) -> _Packable:
    """RESPONSE_EVENT_ERROR (413): an event that was asked for is no longer there."""
    payload = _ERROR.pack(sequence, oldest, *target, 0)
    return _Packable(ERROR_ID, "RESPONSE_EVENT_ERROR", payload)


class RequestEvent:
    """REQUEST_EVENT (412) as it came in.

    Args:
        unknown: what pymavlink made of it.

    Raises:
        ValueError: it is damaged.
    """

    __slots__ = (
        "_source",
        "_unknown",
        "first_sequence",
        "last_sequence",
        "target_component",
        "target_system",
    )

    def __init__(self, unknown: Untyped) -> None:
        raw = bytes(unknown.get_msgbuf())
        end = _HEADER_BYTES + raw[1]
        checksum = dialect.x25crc(raw[1:end])
        checksum.accumulate(bytes([_SEEDS[REQUEST_ID]]))
        if raw[end : end + 2] != struct.pack("<H", checksum.crc):
            raise ValueError("a REQUEST_EVENT with a wrong checksum")
        payload = raw[_HEADER_BYTES:end].ljust(_REQUEST.size, b"\0")
        self.first_sequence, self.last_sequence, self.target_system, self.target_component = (
            _REQUEST.unpack_from(payload)
        )
        self._source = (raw[_SYSTEM_AT], raw[_SYSTEM_AT + 1])
        self._unknown = unknown

    def __getattr__(self, name: str) -> Untyped:
        """Header and signature are those of what came in."""
        return getattr(self._unknown, name)

    def get_srcSystem(self) -> int:  # noqa: N802  # as the generated messages name it
        """The sender's system id, which pymavlink does not read here."""
        return self._source[0]

    def get_srcComponent(self) -> int:  # noqa: N802
        """The sender's component id."""
        return self._source[1]

    def get_type(self) -> str:
        """The message's name."""
        return "REQUEST_EVENT"
