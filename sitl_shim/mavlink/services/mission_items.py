"""Mission items on the wire, and what they mean in the local frame.

https://mavlink.io/en/services/mission.html, https://mavlink.io/en/messages/common.html#MISSION_ITEM_INT
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from sitl_shim.autopilot.mission_plan import PlanItem
from sitl_shim.mavlink.geodesy import local_position
from sitl_shim.mavlink.wire import Message, dialect
from sitl_shim.simulation import GlobalOrigin

ACCEPTED, ERROR, UNSUPPORTED_FRAME, UNSUPPORTED, NO_SPACE = 0, 1, 2, 3, 4
INVALID_LATITUDE, INVALID_LONGITUDE, INVALID_ALTITUDE = 10, 11, 12
INVALID_SEQUENCE, DENIED, CANCELLED = 13, 14, 15
"""MAV_MISSION_RESULT."""
MISSION, FENCE, RALLY, ALL = 0, 1, 2, 255
"""MAV_MISSION_TYPE."""

_GLOBAL, _GLOBAL_INT, _RELATIVE, _RELATIVE_INT = 0, 5, 3, 6
_NO_PLACE = 2
"""MAV_FRAME_MISSION."""
_SEA_LEVEL_FRAMES = (_GLOBAL, _GLOBAL_INT)
_PLACE_FRAMES = (*_SEA_LEVEL_FRAMES, _RELATIVE, _RELATIVE_INT)
_INT_FRAMES = {_GLOBAL: _GLOBAL_INT, _RELATIVE: _RELATIVE_INT}
_FLOAT_FRAMES = {_GLOBAL_INT: _GLOBAL, _RELATIVE_INT: _RELATIVE}
_UNSET = 2**31 - 1
"""A latitude or longitude that says nothing."""
_POLE_E7, _DATE_LINE_E7 = 900_000_000, 1_800_000_000

_WITH_PLACE = frozenset({16, 17, 19, 21, 22, 31, 80, 84, 85, 195, 201})
_WITHOUT_PLACE = frozenset(
    {20, 93, 112, 114, 115, 177, 178, 179, 183, 189, 197, 203, 205, 206, 211, 212, 214}
    | {530, 532, 1000, 1001, 2000, 2001, 2500, 2501, 3000, 4501, 42006}
)
_FENCE_COMMANDS = frozenset({5000, 5001, 5002, 5003, 5004})
_RALLY_COMMANDS = frozenset({5100})


@dataclass(frozen=True, slots=True)
class WireItem:
    """One item as it is stored and sent back."""

    frame: int
    """MAV_FRAME."""
    command: int
    """MAV_CMD."""
    autocontinue: int
    parameters: tuple[float, float, float, float]
    """param1 to param4."""
    x: int
    """Latitude, 1e-7 degrees, or param5 of an item without a place."""
    y: int
    """Longitude, 1e-7 degrees, or param6."""
    z: float
    """Altitude, m, or param7."""


def read_item(message: Message) -> WireItem | int:
    """The item in a MISSION_ITEM_INT, or in the older MISSION_ITEM.

    Returns:
        The item; or the MAV_MISSION_RESULT with which it is refused.
    """
    places = message.frame in _PLACE_FRAMES
    if message.get_type() == "MISSION_ITEM_INT":
        x, y = message.x, message.y
    else:
        scale = 1e7 if places else 1.0
        scaled = (message.x * scale, message.y * scale)
        if not all(math.isfinite(value) and abs(value) < _UNSET for value in scaled):
            scaled = (_UNSET, _UNSET)
        x, y = round(scaled[0]), round(scaled[1])
    item = WireItem(
        frame=_INT_FRAMES.get(message.frame, message.frame),
        command=message.command,
        autocontinue=message.autocontinue,
        parameters=(message.param1, message.param2, message.param3, message.param4),
        x=x,
        y=y,
        z=message.z,
    )
    refusal = _refusal(item, message.mission_type)
    return item if refusal == ACCEPTED else refusal


def _refusal(item: WireItem, mission_type: int) -> int:
    if mission_type == FENCE:
        allowed = item.command in _FENCE_COMMANDS
    elif mission_type == RALLY:
        allowed = item.command in _RALLY_COMMANDS
    else:
        allowed = item.command in _WITH_PLACE or item.command in _WITHOUT_PLACE
    if not allowed:
        return UNSUPPORTED
    if item.command in _WITHOUT_PLACE:
        return ACCEPTED
    if item.frame not in _PLACE_FRAMES:
        return UNSUPPORTED_FRAME
    if item.x != _UNSET and abs(item.x) > _POLE_E7:
        return INVALID_LATITUDE
    if item.y != _UNSET and abs(item.y) > _DATE_LINE_E7:
        return INVALID_LONGITUDE
    return INVALID_ALTITUDE if math.isinf(item.z) else ACCEPTED


def item_message(
    item: WireItem,
    sequence: int,
    mission_type: int,
    target: tuple[int, int],
    *,
    current: bool,
    as_int: bool,
) -> Message:
    """MISSION_ITEM_INT of an item, or the older MISSION_ITEM.

    Args:
        item: what is sent.
        sequence: its index.
        mission_type: MAV_MISSION_TYPE of the list.
        target: system and component that asked for it.
        current: whether it is the one that is, or will be, flown.
        as_int: which of the two messages.
    """
    make: Callable[..., Message]
    if as_int:
        make, frame = dialect.MAVLink_mission_item_int_message, item.frame
        x: float = item.x
        y: float = item.y
    else:
        make = dialect.MAVLink_mission_item_message
        frame = _FLOAT_FRAMES.get(item.frame, item.frame)
        scale = 1e-7 if item.frame in _PLACE_FRAMES else 1.0
        x, y = item.x * scale, item.y * scale
    return make(
        *target,
        sequence,
        frame,
        item.command,
        int(current),
        item.autocontinue,
        *item.parameters,
        x,
        y,
        item.z,
        mission_type,
    )


def plan_item(item: WireItem, origin: GlobalOrigin) -> PlanItem:
    """What an item means to whoever flies it."""
    if item.command in _WITHOUT_PLACE or item.frame not in _PLACE_FRAMES:
        return PlanItem(item.command, item.parameters)
    nowhere = _UNSET in (item.x, item.y) or (item.x == 0 and item.y == 0)
    above_home = item.frame not in _SEA_LEVEL_FRAMES
    return PlanItem(
        item.command,
        item.parameters,
        None if nowhere else local_position(origin, item.x * 1e-7, item.y * 1e-7),
        item.z if above_home else item.z - origin.altitude_amsl_m,
        above_home,
    )
