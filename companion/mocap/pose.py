"""A pose as a motion-capture system has it, and as the companion does."""

import math
from dataclasses import dataclass

from companion.frames import (
    Quaternion,
    Vector3,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_multiply,
    rotate,
)

_Y_UP_TO_Z_UP: Quaternion = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
"""A quarter turn about x: (x, y, z) becomes (x, -z, y)."""
_NO_TURN: Quaternion = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class RoomPose:
    """What a system says of a rigid body, in its own axes."""

    time_s: float
    """By the system's own clock."""
    position_m: Vector3
    attitude: Quaternion
    """(w, x, y, z), unit norm, rigid body to room."""


@dataclass(frozen=True, slots=True)
class Pose:
    """A pose of the vehicle."""

    captured_s: float
    """When it was so, by our clock."""
    position_enu_m: Vector3
    attitude_flu_to_enu: Quaternion
    """(w, x, y, z), unit norm."""


class RoomAxes:
    """Turns a system's axes into ENU and FLU.

    A rigid body whose axes were made parallel to the room's while the nose pointed along x has FLU
    axes, in a room with y up as well as in one with z up.

    Args:
        y_up: the room's y axis is up, and z completes a right-handed frame.
        room_yaw_rad: turns the room about up, positive to the left.
        body_yaw_rad: where the nose is, seen from the rigid body's x axis, positive to the left.
    """

    def __init__(self, *, y_up: bool, room_yaw_rad: float, body_yaw_rad: float) -> None:
        level = _Y_UP_TO_Z_UP if y_up else _NO_TURN
        self._room = quaternion_multiply(quaternion_from_euler(0.0, 0.0, room_yaw_rad), level)
        self._body = quaternion_multiply(
            quaternion_conjugate(level), quaternion_from_euler(0.0, 0.0, body_yaw_rad)
        )

    def pose(self, seen: RoomPose, captured_s: float) -> Pose:
        """The vehicle's pose, with the time that is known of it."""
        attitude = quaternion_multiply(quaternion_multiply(self._room, seen.attitude), self._body)
        return Pose(captured_s, rotate(self._room, seen.position_m), attitude)
