"""Whether a vehicle can have got from one pose to another, by how fast it is and was."""

import math
from collections import deque
from dataclasses import dataclass

from companion.frames import quaternion_conjugate, quaternion_multiply
from companion.mocap.pose import Pose

_POSITION_SLACK_M = 0.1
_ANGLE_SLACK_RAD = 0.3
_ACCELERATION_M_S2 = 10.0
"""As of a vehicle that is tilted by 45°."""
_REMEMBERED_S = 0.1
"""The velocity is taken from poses of so long."""
_LEAST_S = 0.03


def turned_rad(before: Pose, after: Pose) -> float:
    """The angle between two attitudes."""
    turn = quaternion_multiply(
        quaternion_conjugate(before.attitude_flu_to_enu), after.attitude_flu_to_enu
    )
    return 2.0 * math.acos(min(1.0, abs(turn[0])))


def apart(before: Pose, after: Pose) -> float:
    """How different two poses are, to compare: a radian counts as a metre."""
    moved_m = math.dist(before.position_enu_m, after.position_enu_m)
    return moved_m + turned_rad(before, after)


@dataclass(frozen=True, slots=True)
class Plausible:
    """How fast the vehicle can be."""

    speed_m_s: float
    rate_rad_s: float

    def follows(self, before: Pose, after: Pose) -> bool:
        """Whether a vehicle can have got from one pose to the other."""
        passed_s = max(0.0, after.captured_s - before.captured_s)
        distance = math.dist(before.position_enu_m, after.position_enu_m)
        if distance > _POSITION_SLACK_M + self.speed_m_s * passed_s:
            return False
        return turned_rad(before, after) <= _ANGLE_SLACK_RAD + self.rate_rad_s * passed_s


class Motion:
    """Where the vehicle can be next, by the poses that were believed.

    It says how far, not where: stamps that a loaded network made late are so no reason for doubt.

    Args:
        plausible: how fast it can be.
    """

    def __init__(self, plausible: Plausible) -> None:
        self._plausible = plausible
        self._poses: deque[Pose] = deque()

    def take(self, pose: Pose) -> None:
        """Take the next pose that is believed."""
        self._poses.append(pose)
        while self._poses[0].captured_s < pose.captured_s - _REMEMBERED_S:
            self._poses.popleft()

    def begin(self) -> None:
        """Forget what was: the next pose is of another room."""
        self._poses.clear()

    def leads_to(self, pose: Pose) -> bool:
        """Whether the vehicle can have got there; true before the first pose."""
        if not self._poses:
            return True
        newest, oldest = self._poses[-1], self._poses[0]
        if not self._plausible.follows(newest, pose):
            return False
        known_s = newest.captured_s - oldest.captured_s
        if known_s < _LEAST_S:
            return True
        speed_m_s = math.dist(oldest.position_enu_m, newest.position_enu_m) / known_s
        ahead_s = max(0.0, pose.captured_s - newest.captured_s)
        # The speed is that of the middle of the time from which it is known.
        faster_s = ahead_s + 0.5 * known_s
        can_m = speed_m_s * ahead_s + 0.5 * _ACCELERATION_M_S2 * faster_s * faster_s
        return math.dist(newest.position_enu_m, pose.position_enu_m) <= _POSITION_SLACK_M + can_m
