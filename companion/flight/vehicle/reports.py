"""What the vehicle says about itself, newest first-hand: armed, mode, sensors, texts."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from companion.mavlink.codec import decode
from companion.mavlink.dialect import Message
from companion.mavlink.framing import Frame
from companion.mavlink.messages import BASE_MODE_ARMED, MessageId
from companion.mavlink.status_fields import (
    current_mode,
    estimator_flags,
    landed_state,
    sensors,
)

LANDED_ON_GROUND = 1
LANDED_IN_AIR = 2
LANDED_TAKEOFF = 3
LANDED_TAKING_OFF = 3
_PLACES = 0x08 | 0x10
"""ESTIMATOR_POS_HORIZ_REL and _ABS: https://mavlink.io/en/messages/common.html."""
_KEPT_TEXTS = 50
_CHUNK = 50
_LONGEST_TEXT = 1000

REPORT_IDS = frozenset(
    int(message)
    for message in (
        MessageId.CURRENT_MODE,
        MessageId.SYS_STATUS,
        MessageId.EKF_STATUS_REPORT,
        MessageId.ESTIMATOR_STATUS,
        MessageId.EXTENDED_SYS_STATE,
        MessageId.STATUSTEXT,
    )
)
"""Messages that `Reports.take` reads."""

_ESTIMATES = (MessageId.EKF_STATUS_REPORT, MessageId.ESTIMATOR_STATUS)


@dataclass(slots=True)
class Reports:
    """The newest of what the vehicle says about itself."""

    armed: bool = False
    heartbeats: int = 0
    """How many came so far."""
    custom_mode: int | None = None
    system_status: int = 0
    landed_state: int = 0
    sensors: tuple[int, int, int] | None = None
    """Masks present, enabled, health of SYS_STATUS."""
    sensors_of_mode: bool = False
    """That SYS_STATUS came after the present mode was first reported."""
    estimator_flags: int | None = None
    """Of the newest EKF_STATUS_REPORT or ESTIMATOR_STATUS, whose flags are the same."""
    knew_position: bool = False
    """Those have said that the estimator has a horizontal position."""
    battery_remaining: float = math.nan
    texts: list[str] = field(default_factory=list)
    """STATUSTEXTs, oldest first; the last of them."""
    said: int = 0
    """How many came so far."""
    on_mode: Callable[[int], None] | None = None
    """Called with every report of the mode."""
    on_text: Callable[[int, str], None] | None = None
    """Called with MAV_SEVERITY and text of each whole STATUSTEXT."""
    _begun_text: str = ""
    _begun_text_id: int = 0

    def take_heartbeat(self, heartbeat: Message) -> None:
        """Take the vehicle's HEARTBEAT."""
        self.heartbeats += 1
        self.armed = bool(heartbeat.base_mode & BASE_MODE_ARMED)
        self.system_status = int(heartbeat.system_status)
        self._take_mode(int(heartbeat.custom_mode))

    def take(self, frame: Frame) -> None:
        """Take a message of `REPORT_IDS` from the vehicle."""
        message_id = frame.message_id
        if message_id == MessageId.CURRENT_MODE:
            self._take_mode(current_mode(frame))
        elif message_id == MessageId.SYS_STATUS:
            present, enabled, healthy, battery_percent = sensors(frame)
            self.sensors = (present, enabled, healthy)
            self.sensors_of_mode = self.custom_mode is not None
            if battery_percent >= 0:
                self.battery_remaining = battery_percent / 100.0
        elif message_id in _ESTIMATES:
            self.estimator_flags = estimator_flags(frame)
            self.knew_position = self.knew_position or bool(self.estimator_flags & _PLACES)
        elif message_id == MessageId.EXTENDED_SYS_STATE:
            self.landed_state = landed_state(frame)
        elif message_id == MessageId.STATUSTEXT:
            self._take_text(decode(frame))

    def forget(self) -> None:
        """The autopilot has restarted: of what it said only the texts still hold."""
        self.armed = False
        self.custom_mode = None
        self.system_status = 0
        self.landed_state = 0
        self.sensors = None
        self.sensors_of_mode = False
        self.estimator_flags = None
        self.knew_position = False

    @property
    def position_lost(self) -> bool:
        """True if the estimator says that it has no horizontal position any more."""
        flags = self.estimator_flags
        return self.knew_position and flags is not None and not flags & _PLACES

    def _take_mode(self, custom_mode: int) -> None:
        if custom_mode != self.custom_mode:
            self.sensors_of_mode = False
        self.custom_mode = custom_mode
        if self.on_mode is not None:
            self.on_mode(custom_mode)

    def _take_text(self, message: Message) -> None:
        """Join the chunks of a long text: same id, a full chunk is followed by another."""
        chunk, text_id = str(message.text), int(message.id)
        if text_id != 0:
            begun = self._begun_text if text_id == self._begun_text_id else ""
            self._begun_text = (begun + chunk)[:_LONGEST_TEXT]
            self._begun_text_id = text_id
            if len(chunk) >= _CHUNK:
                return
            chunk, self._begun_text, self._begun_text_id = self._begun_text, "", 0
        text = chunk.rstrip("\0\t ")
        self.said += 1
        self.texts.append(text)
        del self.texts[:-_KEPT_TEXTS]
        if self.on_text is not None:
            self.on_text(int(message.severity), text)
