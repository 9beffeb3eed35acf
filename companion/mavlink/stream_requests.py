"""Rates of messages on a link that is shared: the flight's own come first.

An autopilot keeps one rate of each message for a link, so a client that asks for four samples of
the state a second would take the controller's hundred away.  And ArduPilot, asked by the legacy
REQUEST_DATA_STREAM, changes a whole group at once.
"""

import math
import struct

from companion.mavlink.client_command import SET_MESSAGE_INTERVAL, ClientCommand
from companion.mavlink.codec import decode
from companion.mavlink.commands import Result, message_interval
from companion.mavlink.framing import Frame
from companion.mavlink.messages import MessageId, Outgoing, Target

REQUEST_DATA_STREAM = 66
_LONG = struct.Struct("<7fHBBB")
_LATE = 1.001
"""An interval may be rounded on its way through a float."""
_NEVER_A_CLIENTS = frozenset(
    {
        MessageId.HEARTBEAT,
        MessageId.PARAM_VALUE,
        MessageId.COMMAND_ACK,
        MessageId.TIMESYNC,
        MessageId.STATUSTEXT,
    }
)
"""They come by themselves, and without them the companion is blind: HEARTBEAT alone says whether
the vehicle is armed."""
_NO_SLOWER = frozenset(
    {
        MessageId.SYS_STATUS,
        MessageId.ATTITUDE_QUATERNION,
        MessageId.LOCAL_POSITION_NED,
        MessageId.EKF_STATUS_REPORT,
        MessageId.ESTIMATOR_STATUS,
        MessageId.EXTENDED_SYS_STATE,
        MessageId.ODOMETRY,
        MessageId.CURRENT_MODE,
    }
)
"""What a flight asks for; until it has, nobody stops it."""
_EVERYTHING = 0
_GROUPS: dict[int, tuple[int, ...]] = {
    1: (27, 29),
    2: (1, 24, 42, 62),
    3: (36, 65),
    6: (32, 33),
    10: (30,),
    11: (74,),
    12: (2, 147, 193),
}
"""Those of ArduCopter's messages of each MAV_DATA_STREAM that ground stations show: raw sensors,
extended status, RC channels, position, extra 1, 2 and 3."""


class StreamRequests:
    """What the flight asked for, and what a client may."""

    def __init__(self) -> None:
        self._ours_us: dict[int, float] = {}
        """Interval that the flight wants of each message, µs."""
        self._legacy: dict[tuple[int, int], tuple[int, int]] = {}
        """Rate and switch that were last asked for, of each client's system and group."""

    def on_sent(self, message_id: int, raw: bytes) -> None:
        """Learn from a packet of the companion's own what the flight needs."""
        if message_id != MessageId.COMMAND_LONG:
            return
        payload = raw[10 : 10 + raw[1]].ljust(_LONG.size, b"\0")
        wanted, interval_us, *_, command_id, _, _, _ = _LONG.unpack(payload)
        if command_id == SET_MESSAGE_INTERVAL and interval_us > 0.0:
            self._ours_us[int(wanted)] = interval_us

    def answer(self, command: ClientCommand) -> Result | None:
        """What a SET_MESSAGE_INTERVAL is answered with in the vehicle's place; None to pass it on.

        A client that wants a message no more often than it comes anyway has what it asked for.
        """
        if command.command_id != SET_MESSAGE_INTERVAL:
            return None
        wanted, interval_us = command.params[:2]
        if not wanted.is_integer():
            return Result.DENIED  # PX4 and ArduPilot round it differently
        if wanted in _NEVER_A_CLIENTS or math.isnan(interval_us):
            return Result.DENIED
        ours = self._ours_us.get(int(wanted))
        if ours is None:
            return Result.DENIED if wanted in _NO_SLOWER and interval_us < 0.0 else None
        return Result.ACCEPTED if interval_us * _LATE >= ours else Result.DENIED

    def translate(self, frame: Frame, vehicle: Target) -> list[Outgoing]:
        """A REQUEST_DATA_STREAM as intervals of the messages that the flight does not need.

        Clients repeat it every few seconds; only a change gives anything.
        """
        message = decode(frame)
        rate, on = int(message.req_message_rate), int(message.start_stop)
        group = int(message.req_stream_id)
        asked = (frame.system_id, group)
        if self._legacy.get(asked) == (rate, on):
            return []
        self._legacy[asked] = (rate, on)
        groups = list(_GROUPS) if group == _EVERYTHING else [group]
        interval_s = 1.0 / rate if on and rate > 0 else None
        return [
            message_interval(vehicle, wanted, interval_s).as_long()
            for each in groups
            for wanted in _GROUPS.get(each, ())
            if wanted not in self._ours_us
        ]
