"""Which poses are believed: in order, of this moment, new, and where a vehicle can have flown.

What is not believed is dropped and counted by its reason.  Poses that stay somewhere else are of a
room that was calibrated anew, or of a body that was taken for another.  On the ground, where a
person can look, they are believed after a while, which is told.  Once the vehicle is armed they
never are: it would be flown off its path by as much as they are wrong, and the geofence with it.
"""

import math
from collections import Counter

from companion.mocap.doubt import Doubt
from companion.mocap.plausible import Motion, Plausible, turned_rad
from companion.mocap.pose import Pose, RoomAxes, RoomPose
from companion.mocap.sender_clock import SenderClock

JUMP_HELD_S = 1.0
"""On the ground, poses that agree for so long, but not with those before, are a jump for good."""
_NEW_CLOCK_POSES = 5
"""So many poses in order, all older than what was before, are of a clock that was set back."""


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
        """How often the poses jumped for good, on the ground."""
        self.trouble = ""
        """What is the matter with the poses that come now; empty while they are believed."""
        self._axes = axes
        self._motion = Motion(plausible)
        self._doubt = Doubt(plausible, pause_s=timeout_s)
        self._latency_s = latency_s
        self._timeout_s = timeout_s
        self._clock = SenderClock()
        self._last_stamp_s = -math.inf
        self._backward: list[float] = []
        self._seen: RoomPose | None = None
        self._changed_s = -math.inf
        self._noiseless = False

    def take(
        self, seen: RoomPose, received_s: float, *, armed: bool = False, in_air: bool = False
    ) -> bool:
        """Take a pose, or drop and count it; True if it is now the newest.

        Args:
            seen: in the room's axes.
            received_s: when it came, by our clock.
            armed: then no jump is believed, and no pose that is the one before once more.
            in_air: then not even of a source without noise, which while the vehicle stood was
                still to the last bit.
        """
        if not self._in_order(seen.time_s):
            self.dropped["out of order"] += 1
            return False
        captured_s = self._clock.ours(seen.time_s, received_s) - self._latency_s
        if received_s - captured_s - self._latency_s > self._timeout_s:
            self.dropped["stale"] += 1
            return False
        repeated = self._repeated(seen, received_s)
        if not armed:
            self._noiseless = received_s - self._changed_s > self._timeout_s
        if repeated and (in_air or (armed and not self._noiseless)):
            self.dropped["repeated"] += 1
            self.trouble = (
                "The same pose comes again and again, equal to the last bit: the system repeats it "
                "while it does not see the body"
            )
            return False
        pose = self._axes.pose(seen, captured_s)
        if not self._believed(pose):
            self._doubt.add(pose)
            if armed or self._doubt.held_s() < JUMP_HELD_S:
                self.dropped["too far away"] += 1
                self.trouble = self._jump(pose)
                return False
            self._motion.begin()
            self.jumps += 1
        self._doubt.clear()
        self._motion.take(pose)
        self.trouble = ""
        self.newest, self.received_s = pose, received_s
        self.taken += 1
        return True

    def _repeated(self, seen: RoomPose, received_s: float) -> bool:
        """Whether a pose is the one before to the last bit, which noise makes impossible."""
        before, self._seen = self._seen, seen
        if (
            before is not None
            and before.position_m == seen.position_m
            and before.attitude == seen.attitude
        ):
            return True
        self._changed_s = received_s
        return False

    def _believed(self, pose: Pose) -> bool:
        if self.newest is None:
            return True
        return self._motion.leads_to(pose) and not self._doubt.claims(pose, self.newest)

    def _jump(self, pose: Pose) -> str:
        """A jump, for a person."""
        assert self.newest is not None
        distance_m = math.dist(self.newest.position_enu_m, pose.position_enu_m)
        angle_deg = math.degrees(turned_rad(self.newest, pose))
        return (
            f"The poses jumped by {distance_m:.1f} m and {angle_deg:.0f}°: another body, another "
            "room, or markers that were taken for others"
        )

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
