"""How fast the desired trajectory itself asks the vehicle to tilt.

The tilt of a flat trajectory is its horizontal acceleration over g, and the tilt's rate its jerk
over g; drag and lag add little.  The jerk is the third difference of desired positions.  A
controller asks for the tilt earlier than the trajectory, or later, and settles after it: so the
largest value is kept for a while.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.control.frameworks import Reference
from companion.control.thrust import GRAVITY_M_S2

EVERY_S = 0.05
"""No need to look more often."""
_STEP_S = 0.1
_AHEAD_S = 0.2
_HELD_S = 1.0
_FORGOTTEN_S = 0.7
_AS_LARGE = 0.98
_GREATEST_RAD_S = 5.0
"""A reference that jumps asks for no rate that could be flown."""
_TIMES_S = _AHEAD_S + _STEP_S * np.array([-1.5, -0.5, 0.5, 1.5])


@dataclass(frozen=True, slots=True)
class DesiredSlew:
    """The largest rate of the desired tilt of late."""

    rate_rad_s: float = 0.0
    """Held, and then forgotten."""
    peak_s: float = -math.inf
    """When it was seen."""
    looked_s: float = -math.inf


def step(memory: DesiredSlew, reference: Reference, time_s: float) -> DesiredSlew:
    """The same at a time, looked at anew only now and then.

    Args:
        memory: of the tick before.
        reference: desired positions at autopilot times.
        time_s: autopilot's.
    """
    passed_s = time_s - memory.looked_s
    if passed_s < EVERY_S - 1e-6:
        return memory
    first, second, third, fourth = reference(time_s + _TIMES_S)[:, :2].tolist()
    jerk = [
        (d - 3.0 * c + 3.0 * b - a) / _STEP_S**3
        for a, b, c, d in zip(first, second, third, fourth, strict=True)
    ]
    rate = min(_GREATEST_RAD_S, math.hypot(*jerk) / GRAVITY_M_S2)
    kept = memory.rate_rad_s
    if time_s - memory.peak_s > _HELD_S and math.isfinite(passed_s):
        kept *= math.exp(-passed_s / _FORGOTTEN_S)
    if rate >= _AS_LARGE * kept:
        return DesiredSlew(rate, time_s, time_s)
    return DesiredSlew(kept, memory.peak_s, time_s)
