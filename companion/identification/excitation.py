"""What an identification flight plays, and when: parts with pauses between, on a fixed timetable.

Each part comes back, of itself, to where it began.  Tilts are played in patterns of three levels,
``+T, -2T, +T``, thrusts in pairs ``+h, -h``, climb rates in steps with rests between, the signs
chosen so that the way does not add up; the swing grows out of the hover point and shrinks back into
it.  The lengths vary, so that no frequency is left out.  The sizes follow the box.

The timetable is fixed, so that a part that is left early, or missed for a fault, costs only itself.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Literal

from companion.control.thrust import GRAVITY_M_S2
from companion.identification.swing import Swing

Axis = Literal["none", "roll", "pitch", "lift", "climb", "swing"]
"""What a part commands: nothing (the hold flies), roll or pitch beside the hold, vertical
acceleration, climb rate, a way to and fro."""

SMALLEST_BOX_M = 1.2
"""In less, no step lasts until the slowest vehicles have answered it."""
LARGEST_BOX_M = 10.0
HIGHEST_M = 20.0
"""Of a hover point above the ground: no take-off of a mission goes higher."""
LEAST_CLEARANCE_M = 0.5
"""Of the box above the ground."""

_TILT_RAD = math.radians(8.0)
_TILT_STEPS_S = (0.35, 0.5, 0.6, 0.5)
_TILT_SHARE = 0.35
_LIFT_SHARE_OF_WEIGHT = 0.35
_LIFT_STEPS_S = (0.12, 0.3, 0.4, 0.2, 0.24, 0.16)
_LIFT_PAIRS = 22
_LIFT_SHARE = 0.45
_CLIMB_M_S, _CLIMB_STEP_S, _CLIMB_STEPS = 0.6, 0.8, 4
_CLIMB_RATE_M_S, _CLIMB_RATE_STEPS_S = 0.5, (1.3, 0.9, 1.1)
_CLIMB_SHARE = 0.55
_RATE_STEPS_IN_LIFT, _RATE_STEPS_IN_CLIMB = 5, 3
_SWING_S = 15.0
_SWING_SHARE, _LARGEST_SWING_M = 0.66, 1.8
_HOVER_S = 6.0
_PAUSE_S = 0.8
_LAST_PAUSE_S = 1.5
_TALLEST_M = 1.2
"""Half the height of the box, at most."""


@dataclass(frozen=True, slots=True)
class Part:
    """Levels of one command, each for a while; or a swing."""

    name: str
    """As the recording's segments are named."""
    axis: Axis
    levels: tuple[float, ...]
    """rad, m/s² or m/s; of `none` and `swing` zeros."""
    durations_s: tuple[float, ...]
    over_climb_rate: "Part | None" = None
    """What is played in its time where the thrust field is a climb rate; None: itself, but for
    thrust."""
    swing: Swing | None = None
    """Of the axis `swing`."""
    ends_s: tuple[float, ...] = field(init=False)
    """End of each level, since the part began."""

    def __post_init__(self) -> None:
        """Add up, once: levels are looked up at every sample."""
        object.__setattr__(self, "ends_s", tuple(accumulate(self.durations_s)))

    @property
    def duration_s(self) -> float:
        """Until the command is back."""
        return self.ends_s[-1]

    @property
    def slot_s(self) -> float:
        """The time that the timetable has for it, whatever the thrust field means."""
        other = self.over_climb_rate
        return self.duration_s if other is None else max(self.duration_s, other.duration_s)

    def level(self, since_s: float) -> float:
        """The command, this long after the part began."""
        return self.levels[min(bisect_right(self.ends_s, since_s), len(self.levels) - 1)]


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
        ValueError: too small or too large a box, too low or too high a hover, or one that is no
            number; the text says what would do.
    """
    if not SMALLEST_BOX_M <= half_width_m <= LARGEST_BOX_M:
        raise ValueError(
            f"a box of ±{half_width_m:g} m is not flown in, only of {SMALLEST_BOX_M:g} to "
            f"{LARGEST_BOX_M:g} m"
        )
    least = LEAST_CLEARANCE_M + 0.5 * _TALLEST_M
    if height_m < least:
        raise ValueError(f"a hover of {height_m:g} m is too low: {least:g} m at least")
    if not height_m <= HIGHEST_M:  # nor is NaN
        raise ValueError(
            f"a hover at {height_m:g} m is not flown, only at {least:g} to {HIGHEST_M:g} m"
        )
    vertical = min(_TALLEST_M, height_m - LEAST_CLEARANCE_M)
    return Box(half_width_m, vertical)


def plan_program(box: Box, speed_limit_m_s: float) -> Program:
    """The timetable of an identification flight.

    Args:
        box: where it must stay.
        speed_limit_m_s: of the vehicle.
    """
    push = GRAVITY_M_S2 * math.tan(_TILT_RAD)
    shrink = min(1.0, math.sqrt(_TILT_SHARE * box.horizontal_m / push) / max(_TILT_STEPS_S))
    tilt_steps_s = [shrink * step_s for step_s in _TILT_STEPS_S]
    lift = min(
        _LIFT_SHARE_OF_WEIGHT * GRAVITY_M_S2,
        _LIFT_SHARE * box.vertical_m / max(_LIFT_STEPS_S) ** 2,
    )
    pairs_s = [_LIFT_STEPS_S[k % len(_LIFT_STEPS_S)] for k in range(_LIFT_PAIRS)]
    largest = _CLIMB_SHARE * box.vertical_m
    climb = min(_CLIMB_M_S, largest / _CLIMB_STEP_S)
    rate = min(_CLIMB_RATE_M_S, largest / max(_CLIMB_RATE_STEPS_S))
    timetable = (
        Part("hover", "none", (0.0,), (_HOVER_S,)),
        _tilts("roll", tilt_steps_s),
        _tilts("pitch", tilt_steps_s),
        _lifts(lift, pairs_s, _rates(rate, 0, _RATE_STEPS_IN_LIFT)),
        _climbs(
            climb,
            [_CLIMB_STEP_S] * (2 * _CLIMB_STEPS),
            _rates(rate, _RATE_STEPS_IN_LIFT, _RATE_STEPS_IN_CLIMB),
        ),
        _swing(box, speed_limit_m_s),
    )
    begins, total = [], 0.0
    for part in timetable:
        begins.append(total)
        total += part.slot_s + _PAUSE_S
    return Program(timetable, tuple(begins), total - _PAUSE_S + _LAST_PAUSE_S)


def _tilts(axis: Literal["roll", "pitch"], steps_s: Sequence[float]) -> Part:
    """Patterns that lead from rest to rest ``g tan(tilt) T²`` away, there and back in turn."""
    levels, durations = [], []
    for index, step_s in enumerate(steps_s):
        size = _TILT_RAD * (-1.0) ** index
        levels += [size, -size, size]
        durations += [step_s, 2.0 * step_s, step_s]
    return Part(axis, axis, tuple(levels), tuple(durations))


def _lifts(size_m_s2: float, steps_s: Sequence[float], over_climb_rate: Part) -> Part:
    """Pairs of an acceleration and its opposite; each leads ``a h²`` up or down."""
    levels, durations, way = [], [], 0.0
    for step_s in steps_s:
        size = -math.copysign(size_m_s2, way) if way else size_m_s2
        way += size * step_s**2
        levels += [size, -size]
        durations += [step_s, step_s]
    return Part("thrust", "lift", tuple(levels), tuple(durations), over_climb_rate)


def _climbs(size_m_s: float, steps_s: Sequence[float], over_climb_rate: Part | None = None) -> Part:
    """Steps of climb rate, each followed by a rest; towards the middle, whichever way that is."""
    levels, way = [], 0.0
    for index, step_s in enumerate(steps_s):
        size = 0.0
        if index % 2 == 0:
            size = -math.copysign(size_m_s, way) if abs(way) > 1e-9 else size_m_s
            way += size * step_s
        levels.append(size)
    return Part("climb", "climb", tuple(levels), tuple(steps_s), over_climb_rate)


def _rates(size_m_s: float, first: int, steps: int) -> Part:
    """Slower and longer ones, for an autopilot's own loop, whose acceleration is limited."""
    cycle = _CLIMB_RATE_STEPS_S
    return _climbs(size_m_s, [cycle[k % len(cycle)] for k in range(2 * first, 2 * (first + steps))])


def _swing(box: Box, speed_limit_m_s: float) -> Part:
    """As wide as box and vehicle allow."""
    radius = min(_SWING_SHARE * box.horizontal_m, _LARGEST_SWING_M)
    swing = Swing(radius, _SWING_S)
    swing = Swing(radius * min(1.0, speed_limit_m_s / swing.top_speed_m_s), _SWING_S)
    return Part("swing", "swing", (0.0,), (_SWING_S,), swing=swing)
