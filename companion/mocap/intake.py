"""Which poses are believed: in order, of this moment, and not farther away than a vehicle can fly.

What is not believed is dropped and counted by its reason.  A pose that is too far away is one of
two things: an error of a few frames (swapped markers), or a jump for good (the room calibrated
anew); which, the next poses tell.
"""

import math
from collections import Counter
from dataclasses import dataclass

from companion.frames import quaternion_conjugate, quaternion_multiply
from companion.mocap.pose import Pose, RoomAxes, RoomPose
from companion.mocap.sender_clock import SenderClock

_POSITION_SLACK_M = 0.1
_ANGLE_SLACK_RAD = 0.3
_JUMP_POSES = 5
"""So many poses that agree among themselves, and not with what was before, are a jump."""
_NEW_CLOCK_POSES = 5
"""So many poses in order, all older than what was before, are of a clock that was set back."""


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
        turn = quaternion_multiply(
            quaternion_conjugate(before.attitude_flu_to_enu), after.attitude_flu_to_enu
        )
        angle = 2.0 * math.acos(min(1.0, abs(turn[0])))
        return angle <= _ANGLE_SLACK_RAD + self.rate_rad_s * passed_s


class Intake:
    """The newest pose that is believed.

    Args:
        axes: turns the room's axes into ours.
        plausible: how fast the vehicle can be.
        latency_s: from the exposure until the pose is here, at its shortest.
        timeout_s: a pose that has taken longer is dropped.
    """

    def __init__(
        self, axes: RoomAxes, plausible: Plausible, *, latency_s: float, timeout_s: float
    ) -> None:
        self.newest: Pose | None = None
        self.received_s = -math.inf
        """When it came."""
        self.taken = 0
        self.dropped: Counter[str] = Counter()
        """How many datagrams were dropped, by the reason."""
        self.jumps = 0
        """How often the poses jumped for good."""
        self._axes = axes
        self._plausible = plausible
        self._latency_s = latency_s
        self._timeout_s = timeout_s
        self._clock = SenderClock()
        self._last_stamp_s = -math.inf
        self._backward: list[float] = []
        self._far: list[Pose] = []

    def take(self, seen: RoomPose, received_s: float) -> bool:
        """Take a pose, or drop and count it; True if it is now the newest."""
        if not self._in_order(seen.time_s):
            self.dropped["out of order"] += 1
            return False
        captured_s = self._clock.ours(seen.time_s, received_s) - self._latency_s
        if received_s - captured_s - self._latency_s > self._timeout_s:
            self.dropped["stale"] += 1
            return False
        pose = self._axes.pose(seen, captured_s)
        newest = self.newest
        if newest is not None and not self._plausible.follows(newest, pose):
            if not self._jumped(pose):
                self.dropped["too far away"] += 1
                return False
            self.jumps += 1
        self._far = []
        self.newest, self.received_s = pose, received_s
        self.taken += 1
        return True

    def _in_order(self, stamp_s: float) -> bool:
        """Whether a time stamp is later than the last, or of a clock that was set back."""
        if stamp_s > self._last_stamp_s:
            self._backward = []
        else:
            if self._backward and stamp_s <= self._backward[-1]:
                self._backward = []
            self._backward.append(stamp_s)
            if len(self._backward) < _NEW_CLOCK_POSES:
                return False
            self._backward = []
            self._clock = SenderClock()
        self._last_stamp_s = stamp_s
        return True

    def _jumped(self, pose: Pose) -> bool:
        if self._far and not self._plausible.follows(self._far[-1], pose):
            self._far = []
        self._far.append(pose)
        return len(self._far) >= _JUMP_POSES
