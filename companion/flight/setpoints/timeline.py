"""The reference of a whole flight: approach, hover, track, return, one after another in time."""

from bisect import bisect_right
from dataclasses import dataclass, field

import numpy as np

from companion.frames import Vector3
from companion.trajectories.smooth_time import smooth_step7, smooth_step7_at
from companion.trajectories.trajectory import Array, Trajectory

_STEP7_PEAK_SPEED = 35.0 / 16.0
"""Greatest slope of the smooth step over a unit of time."""
SHORTEST_MOVE_S = 2.0


@dataclass(frozen=True, slots=True)
class Move:
    """A straight line from rest to rest."""

    phase: str
    from_m: Array
    to_m: Array
    duration_s: float

    def position(self, times_s: Array) -> Array:
        """Positions (samples, 3) at times since the beginning of the move."""
        share = smooth_step7(times_s / self.duration_s)
        moved: Array = self.from_m + share[:, None] * (self.to_m - self.from_m)
        return moved

    def position_at(self, time_s: float) -> Vector3:
        """Position at one time since the beginning of the move."""
        share = smooth_step7_at(time_s / self.duration_s)
        (x, y, z), (to_x, to_y, to_z) = self.from_m.tolist(), self.to_m.tolist()
        return x + share * (to_x - x), y + share * (to_y - y), z + share * (to_z - z)


@dataclass(frozen=True, slots=True)
class Track:
    """The trajectory itself."""

    phase: str
    trajectory: Trajectory
    """Placed in the local frame already."""

    @property
    def duration_s(self) -> float:
        """Until it rests."""
        return self.trajectory.end_s

    def position(self, times_s: Array) -> Array:
        """Positions (samples, 3) at times since the beginning of the trajectory."""
        return self.trajectory.position(times_s)

    def position_at(self, time_s: float) -> Vector3:
        """Position at one time since the beginning of the trajectory."""
        return self.trajectory.position_at(time_s)


Segment = Move | Track


@dataclass(frozen=True, slots=True)
class Timeline:
    """Segments from a start on the autopilot's clock; it rests at its end."""

    start_s: float
    segments: tuple[Segment, ...]
    begins_s: tuple[float, ...]
    """Begin of each segment, since `start_s`."""
    end_s: float
    """End of the last segment, since `start_s`."""
    _scored_s: tuple[float, float] | None = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Look up when tracking is scored."""
        scored = None
        for segment, begin in reversed(list(zip(self.segments, self.begins_s, strict=True))):
            if isinstance(segment, Track):
                start = self.start_s + begin
                scored = (start, start + segment.trajectory.scored_s)
        object.__setattr__(self, "_scored_s", scored)

    def position(self, autopilot_times_s: Array) -> Array:
        """Desired positions (samples, 3), ENU m, at times of the autopilot's clock."""
        times = autopilot_times_s - self.start_s
        if len(times) == 1:
            first = last = self._index(float(times[0]))
        else:
            # By their places, which is quicker than min() and max().
            first = self._index(float(times[times.argmin()]))
            last = self._index(float(times[times.argmax()]))
        if first == last:
            return self.segments[first].position(times - self.begins_s[first])
        which = np.clip(np.searchsorted(self.begins_s, times, side="right") - 1, 0, None)
        position = np.empty((len(times), 3))
        for k in range(first, last + 1):
            inside = which == k
            if inside.any():
                position[inside] = self.segments[k].position(times[inside] - self.begins_s[k])
        return position

    def position_at(self, autopilot_time_s: float) -> Vector3:
        """Desired position, ENU m, at one time: `position` in plain floats."""
        time_s = autopilot_time_s - self.start_s
        index = self._index(time_s)
        return self.segments[index].position_at(time_s - self.begins_s[index])

    def phase(self, autopilot_time_s: float) -> str:
        """Name of the segment at a time of the autopilot's clock."""
        return self.segments[self._index(autopilot_time_s - self.start_s)].phase

    def finished(self, autopilot_time_s: float) -> bool:
        """True once the last segment is over."""
        return autopilot_time_s - self.start_s >= self.end_s

    @property
    def scored_s(self) -> tuple[float, float]:
        """First and last time of the autopilot's clock at which tracking is scored."""
        if self._scored_s is None:
            raise ValueError("a timeline without a trajectory has no scored part")
        return self._scored_s

    def _index(self, time_s: float) -> int:
        return max(0, bisect_right(self.begins_s, time_s) - 1)


def plan_timeline(
    trajectory: Trajectory,
    *,
    start_s: float,
    from_m: Array,
    home_m: Array,
    hover_s: float,
    speed_m_s: float,
    shortest_approach_s: float = SHORTEST_MOVE_S,
) -> Timeline:
    """Reference from where the vehicle is, over the trajectory, to above where it took off.

    Args:
        trajectory: what to track, in the autopilot's local frame.
        start_s: autopilot's time at which the reference begins.
        from_m: (3,) position then.
        home_m: (3,) where to return to.
        hover_s: hover before the trajectory.
        speed_m_s: greatest speed of approach and return.
        shortest_approach_s: the approach takes at least this, however near the start is.
    """
    start = trajectory.position(np.zeros(1))[0]
    end = trajectory.position(np.array([trajectory.end_s]))[0]
    segments: list[Segment] = [
        _move("approach", from_m, start, speed_m_s, shortest_approach_s),
        Move("hover", start, start, max(hover_s, 1e-3)),
        Track("track", trajectory),
        Move("settle", end, end, 1.0),
        _move("return", end, home_m, speed_m_s),
        Move("settle", home_m, home_m, 1.0),
    ]
    begins, total = [], 0.0
    for segment in segments:
        begins.append(total)
        total += segment.duration_s
    return Timeline(start_s, tuple(segments), tuple(begins), total)


def _move(
    phase: str,
    from_m: Array,
    to_m: Array,
    speed_m_s: float,
    shortest_s: float = SHORTEST_MOVE_S,
) -> Move:
    distance = float(np.linalg.norm(to_m - from_m))
    duration = max(shortest_s, _STEP7_PEAK_SPEED * distance / speed_m_s)
    return Move(phase, np.array(from_m), np.array(to_m), duration)
