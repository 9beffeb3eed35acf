"""The plain input: one JSON object in each UDP datagram.

    {"body": "drone", "t": 12.34, "position": [x, y, z], "attitude": [w, x, y, z]}

Metres and seconds.  ``t`` is the time of the exposure by any clock that does not jump; ``attitude``
turns the rigid body into the room.  Further keys are ignored.
"""

import json
import math
from typing import Any, NoReturn

from companion.frames import quaternion_normalise
from companion.mocap.pose import RoomPose

LONGEST = 4096
"""Bytes; a pose takes about 150."""
_NORM_ERROR = 0.1


class DroppedError(Exception):
    """A datagram that is no pose of the vehicle; the text is the reason that is counted."""


def read_pose(data: bytes, body: str) -> RoomPose:
    """Read a datagram.

    Raises:
        DroppedError: it is not JSON, of another body, or has a number that is none.
    """
    if len(data) > LONGEST:
        raise DroppedError("not JSON")
    try:
        message = json.loads(data, parse_constant=_not_a_number)
    except (ValueError, RecursionError) as error:
        raise DroppedError("not JSON") from error
    if not isinstance(message, dict):
        raise DroppedError("not a pose")
    if message.get("body") != body:
        raise DroppedError("of another body")
    x, y, z = _numbers(message, "position", 3)
    w, i, j, k = _numbers(message, "attitude", 4)
    if abs(math.hypot(w, i, j, k) - 1.0) > _NORM_ERROR:
        raise DroppedError("not a rotation")
    (time_s,) = _numbers(message, "t", 1)
    return RoomPose(time_s, (x, y, z), quaternion_normalise((w, i, j, k)))


def write_pose(body: str, pose: RoomPose) -> bytes:
    """The datagram of a pose; the inverse of `read_pose`."""
    message = {
        "body": body,
        "t": pose.time_s,
        "position": pose.position_m,
        "attitude": pose.attitude,
    }
    return json.dumps(message).encode()


def _numbers(message: dict[str, Any], key: str, count: int) -> list[float]:
    value = message.get(key)
    values = [value] if count == 1 else value
    if not isinstance(values, list) or len(values) != count:
        raise DroppedError("not a pose")
    numbers = []
    for item in values:
        if isinstance(item, bool) or not isinstance(item, (int, float)):
            raise DroppedError("not a pose")
        try:
            number = float(item)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number) or abs(number) > 1e12:
            raise DroppedError("not a number")
        numbers.append(number)
    return numbers


def _not_a_number(_: str) -> NoReturn:
    # NaN and Infinity are no JSON, but Python's writer makes them.
    raise DroppedError("not a number")
