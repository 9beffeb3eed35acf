"""STATUSTEXT (253): texts for a person, in chunks where they are long.

https://mavlink.io/en/messages/common.html#STATUSTEXT
"""

from collections.abc import Iterator

from sitl_shim.autopilot.interface import StatusText
from sitl_shim.mavlink.wire import Message, dialect

CHUNK_BYTES = 50


def status_messages(text: StatusText, text_id: int) -> Iterator[Message]:
    """The messages of one text; the chunks of a long one share the id."""
    data = text.text.encode()
    for sequence, start in enumerate(range(0, max(1, len(data)), CHUNK_BYTES)):
        yield dialect.MAVLink_statustext_message(
            text.severity, data[start : start + CHUNK_BYTES], text_id, sequence
        )
