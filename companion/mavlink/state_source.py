"""Which messages the vehicle's state is made of, and the making.

ODOMETRY has all of it in one message.  Where an autopilot does not grant that (ArduPilot, or a
PX4 built without), LOCAL_POSITION_NED and the newest ATTITUDE_QUATERNION make it together.
"""

from enum import Enum

from companion.mavlink.dialects.base import Stream
from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId
from companion.mavlink.telemetry import (
    Rejected,
    WireAttitude,
    local_position,
    state_from_odometry,
    state_from_parts,
    unwrapped_s,
    wire_attitude,
)
from companion.vehicle_state import VehicleState


class StateSource(Enum):
    """Messages that the state is made of; the last of them completes a sample."""

    ODOMETRY = (MessageId.ODOMETRY,)
    PARTS = (MessageId.ATTITUDE_QUATERNION, MessageId.LOCAL_POSITION_NED)

    @property
    def messages(self) -> tuple[MessageId, ...]:
        """The messages."""
        messages: tuple[MessageId, ...] = self.value
        return messages

    @property
    def names(self) -> str:
        """Their names, for a person."""
        return " and ".join(message.name for message in reversed(self.messages))


PARTS_IN_PLACE_OF_ODOMETRY = tuple(
    Stream(message, 0.010, required=True) for message in StateSource.PARTS.messages
)
"""What to ask for where ODOMETRY is refused."""

STATE_MESSAGES = frozenset(int(message) for source in StateSource for message in source.messages)
"""Messages that `StateReader.take` reads."""

# Names of an enumeration are looked up slowly, and these are compared with at every frame.
_ODOMETRY = int(MessageId.ODOMETRY)
_ATTITUDE_QUATERNION = int(MessageId.ATTITUDE_QUATERNION)
_LOCAL_POSITION_NED = int(MessageId.LOCAL_POSITION_NED)
_WHOLE = StateSource.ODOMETRY


class StateReader:
    """Makes the state of what comes from the chosen source; the other one's messages are ignored.

    Many autopilots stream both unasked, and samples of two kinds would be flown on in turn.
    """

    __slots__ = ("_attitude", "source")

    def __init__(self) -> None:
        self.source = _WHOLE
        self._attitude: WireAttitude | None = None

    def take(self, frame: Frame, about_s: float) -> VehicleState | Rejected | None:
        """Take a message of `STATE_MESSAGES`; None if it does not complete a sample.

        Args:
            frame: the message, of the vehicle.
            about_s: the autopilot's time since boot as far as it is known, to undo the wrap of
                32-bit times; 0 if it is not known.
        """
        message_id = frame.message_id
        if self.source is _WHOLE:
            return state_from_odometry(frame) if message_id == _ODOMETRY else None
        if message_id == _ATTITUDE_QUATERNION:
            self._attitude = wire_attitude(frame)
            return None
        if message_id != _LOCAL_POSITION_NED:
            return None
        if self._attitude is None:
            return Rejected("LOCAL_POSITION_NED came before any ATTITUDE_QUATERNION")
        position = local_position(frame)
        return state_from_parts(
            position, self._attitude, unwrapped_s(position.time_boot_ms, about_s)
        )

    def forget(self) -> None:
        """Begin anew: the autopilot has restarted."""
        self._attitude = None
