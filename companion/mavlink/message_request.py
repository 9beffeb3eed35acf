"""Asking for one message, once (MAV_CMD_REQUEST_MESSAGE)."""

from companion.mavlink.commands import Command
from companion.mavlink.messages import Target

REQUEST_MESSAGE = 512


def request_message(target: Target, message_id: int) -> Command:
    """The command that asks for a message; it comes before the acknowledgement, or never."""
    return Command(REQUEST_MESSAGE, target, (float(message_id), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
