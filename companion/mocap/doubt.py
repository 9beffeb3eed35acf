"""Poses that are not believed, and whether they are of one place.

What comes from somewhere else is an error of a few frames (swapped markers), a body that was taken
for another, or a room that was calibrated anew.  While nothing else comes, the time in which the
vehicle might have got there grows; so a pose that is nearer to what was not believed than to what
was, is not believed either.
"""

from companion.mocap.plausible import Plausible, apart
from companion.mocap.pose import Pose

_MOST = 8
"""Places that are remembered."""


class Doubt:
    """The places from which poses came that were not believed, since the last that was.

    Args:
        plausible: how fast the vehicle can be.
        pause_s: poses farther apart in time are not of one stay.
    """

    def __init__(self, plausible: Plausible, *, pause_s: float) -> None:
        self._plausible = plausible
        self._pause_s = pause_s
        self._places: list[Pose] = []
        """The newest pose of each, in the order of their coming."""
        self._since_s = 0.0

    @property
    def newest(self) -> Pose | None:
        """The newest pose that was not believed, if none was since."""
        return self._places[-1] if self._places else None

    def claims(self, pose: Pose, believed: Pose) -> bool:
        """Whether a pose is nearer to one that was not believed."""
        near = apart(believed, pose)
        return any(apart(place, pose) < near for place in self._places)

    def add(self, pose: Pose) -> None:
        """Take a pose that is not believed."""
        newest = self.newest
        if (
            newest is None
            or pose.captured_s - newest.captured_s > self._pause_s
            or not self._plausible.follows(newest, pose)
        ):
            self._since_s = pose.captured_s
        left = [place for place in self._places if not self._plausible.follows(place, pose)]
        self._places = [*left, pose][-_MOST:]

    def held_s(self) -> float:
        """How long they have agreed among themselves."""
        newest = self.newest
        return 0.0 if newest is None else newest.captured_s - self._since_s

    def clear(self) -> None:
        """A pose was believed."""
        self._places.clear()
