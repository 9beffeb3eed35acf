"""What an identification flight plays, and when: parts with pauses between, on a fixed timetable.

Each part changes one command in steps and returns, of itself, to where it began: a doublet there
and back, ``+T, -2T, +T``, ends at rest at the hover point, and so does the swing.  In the pauses
the hold flies, and makes good what wind and drag have left.  The sizes follow the box.

The timetable is fixed, so that a part that is left early, or missed for a fault, costs only itself.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass
from itertools import accumulate
from typing import Literal

from companion.control.thrust import GRAVITY_M_S2

Axis = Literal["none", "roll", "pitch", "lift", "climb"]
"""What a part commands: nothing (the hold flies), roll or pitch about the trim, vertical
acceleration open loop, climb rate."""

SMALLEST_BOX_M = 1.2
"""In less, no step lasts until the slowest vehicles have answered it."""
LARGEST_BOX_M = 10.0
LEAST_CLEARANCE_M = 0.5
"""Of the box above the ground."""

_TILT_RAD = math.radians(8.0)
_SWING_TILT_RAD = math.radians(10.0)
_LIFT_M_S2 = 1.5
_CLIMB_M_S = 0.5
_DOUBLET_SHARE, _LARGEST_DOUBLET_M = 0.35, 0.9
"""How far a doublet goes: of the box, and at most."""
_SWING_SHARE, _LARGEST_SWING_M = 0.45, 1.3
_LIFT_RISE_M = 0.19
_CLIMB_STEP_S, _CLIMB_SHARE = 1.0, 0.45
_HOVER_S = 7.0
_SETTLE_S = 2.0
_LONG_SETTLE_S = 2.5
_TALLEST_M = 1.2
"""Half the height of the box, at most."""
_ROOT2 = math.sqrt(2.0)


@dataclass(frozen=True, slots=True)
class Part:
    """Levels of one command, each for a while."""

    name: str
    """As the recording's segments are named."""
    axis: Axis
    levels: tuple[float, ...]
    """rad, m/s² or m/s; of `none` zeros."""
    durations_s: tuple[float, ...]
    over_climb_rate: "Part | None" = None
    """What is played in its time where the thrust field is a climb rate; None: itself."""

    @property
    def duration_s(self) -> float:
        """Until the command is back."""
        return math.fsum(self.durations_s)

    @property
    def slot_s(self) -> float:
        """The time that the timetable has for it, whatever the thrust field means."""
        other = self.over_climb_rate
        return self.duration_s if other is None else max(self.duration_s, other.duration_s)

    def level(self, since_s: float) -> float:
        """The command, this long after the part began."""
        ends = list(accumulate(self.durations_s))
        return self.levels[min(bisect_right(ends, since_s), len(self.levels) - 1)]


@dataclass(frozen=True, slots=True)
class Box:
    """Where an identification flight may be, about its hover point."""

    horizontal_m: float
    """Half its width."""
    vertical_m: float
    """Half its height."""

    def outside_m(self, offset_m: tuple[float, float, float]) -> float:
        """How far outside it a point is, seen from the hover point; negative within."""
        x, y, z = offset_m
        return max(max(abs(x), abs(y)) - self.horizontal_m, abs(z) - self.vertical_m)


@dataclass(frozen=True, slots=True)
class Program:
    """Parts and when each begins, s since the timetable's begin."""

    parts: tuple[Part, ...]
    begins_s: tuple[float, ...]
    duration_s: float
    """The last pause included."""

    def at(self, time_s: float) -> int | None:
        """Index of the part whose time it is; None in a pause, and before and after."""
        index = bisect_right(self.begins_s, time_s) - 1
        if index < 0 or time_s >= self.begins_s[index] + self.parts[index].slot_s:
            return None
        return index


def box_about(half_width_m: float, height_m: float) -> Box:
    """The box about a hover point.

    Args:
        half_width_m: as asked for.
        height_m: of the hover point above the ground.

    Raises:
        ValueError: too small a box, or too low a hover; the text says what would do.
    """
    if not SMALLEST_BOX_M <= half_width_m <= LARGEST_BOX_M:
        raise ValueError(
            f"a box of ±{half_width_m:g} m is not flown in, only of {SMALLEST_BOX_M:g} to "
            f"{LARGEST_BOX_M:g} m"
        )
    vertical = min(_TALLEST_M, height_m - LEAST_CLEARANCE_M)
    if vertical < 0.5 * _TALLEST_M:
        least = LEAST_CLEARANCE_M + 0.5 * _TALLEST_M
        raise ValueError(f"a hover of {height_m:g} m is too low: {least:g} m at least")
    return Box(half_width_m, vertical)


def plan_program(box: Box) -> Program:
    """The timetable of an identification flight in a box."""
    doublet_m = min(_DOUBLET_SHARE * box.horizontal_m, _LARGEST_DOUBLET_M)
    tilt_s = math.sqrt(doublet_m / (GRAVITY_M_S2 * math.tan(_TILT_RAD)))
    lift_s = math.sqrt(_LIFT_RISE_M / _LIFT_M_S2)
    climb_s = min(_CLIMB_STEP_S, _CLIMB_SHARE * box.vertical_m / _CLIMB_M_S)
    climb = _there_and_back("climb", "climb", _CLIMB_M_S, climb_s)
    more_climb = _there_and_back("climb", "climb", -_CLIMB_M_S, climb_s)

    def tilts(sign: float) -> list[tuple[Part, float]]:
        return [
            (_there_and_back(axis, axis, sign * _TILT_RAD, tilt_s), _SETTLE_S)
            for axis in ("roll", "pitch")
        ]

    lift = _there_and_back("thrust", "lift", _LIFT_M_S2, lift_s, more_climb)
    down = _there_and_back("thrust", "lift", -_LIFT_M_S2, lift_s)
    timetable = [
        (Part("hover", "none", (0.0,), (_HOVER_S,)), 0.5),
        *tilts(1.0),
        (lift, _SETTLE_S),
        (climb, _SETTLE_S),
        *tilts(-1.0),
        (down, _SETTLE_S),
        (_swing(box), _LONG_SETTLE_S),
    ]
    begins, total = [], 0.0
    for part, pause_s in timetable:
        begins.append(total)
        total += part.slot_s + pause_s
    return Program(tuple(part for part, _ in timetable), tuple(begins), total)


def _there_and_back(
    name: str, axis: Axis, size: float, step_s: float, over_climb_rate: Part | None = None
) -> Part:
    return Part(name, axis, (size, -size, size), (step_s, 2.0 * step_s, step_s), over_climb_rate)


def _swing(box: Box) -> Part:
    """From rest to and fro about the hover point and back to rest there, by two levels alone.

    With an acceleration a and ``A = a τ²``: out to A, through to -A, back to A, and to the middle.
    """
    reach_m = min(_SWING_SHARE * box.horizontal_m, _LARGEST_SWING_M)
    tau = math.sqrt(reach_m / (GRAVITY_M_S2 * math.tan(_SWING_TILT_RAD)))
    durations = (tau, (1.0 + _ROOT2) * tau, 2.0 * _ROOT2 * tau, (_ROOT2 + 1.0) * tau, tau)
    levels = tuple(_SWING_TILT_RAD * (-1.0) ** k for k in range(len(durations)))
    return Part("swing", "pitch", levels, durations)
