"""How a flight ended, by the truth: on the ground or in the air, gently or not."""

import math

import numpy as np

from companion.experiments.faults.evidence import Evidence, TruePath

CRASH_SPEED_M_S = 2.0
"""At the ground: downwards, and sideways."""
CRASH_TILT_RAD = math.radians(60.0)
_GROUND_M = 0.03
"""Above where it stood: so low is on the ground."""
_AIRBORNE_M = 0.3
_BEFORE_TOUCH_S = 0.15
_STILL_M_S = 0.3
_LAST_S = 2.0
_SINKS_M_S = 0.15
_FALLS_M_S = 1.5
"""Sinks faster than an autopilot brings a vehicle down from these heights."""
_SLIDES_M_S = 1.0
"""Sideways; what is brought down does not."""


def ending_of(evidence: Evidence) -> str:
    """How a flight ended, by the truth, and by the companion who brought it down."""
    path = evidence.path
    if not len(path.time_s) or not flew(path):
        return "not flown"
    if crashed(path):
        return "crashed"
    last = path.time_s >= path.time_s[-1] - _LAST_S
    heights = path.position_enu_m[last, 2] - path.position_enu_m[0, 2]
    if float(heights[-1]) < _GROUND_M:
        return "landed" if evidence.outcome == "landed" else "handed over"
    velocities = path.velocity_enu_m_s[last]
    if float(velocities[:, 2].min()) < -_FALLS_M_S:
        return "drifting"
    velocity = velocities.mean(axis=0)
    if velocity[2] < -_SINKS_M_S:
        return "handed over" if math.hypot(velocity[0], velocity[1]) < _SLIDES_M_S else "drifting"
    return "held" if math.hypot(*velocity) < _STILL_M_S else "drifting"


def flew(path: TruePath) -> bool:
    """Whether it left the ground."""
    return bool((path.position_enu_m[:, 2] - path.position_enu_m[0, 2] > _AIRBORNE_M).any())


def crashed(path: TruePath) -> bool:
    """Whether it hit the ground, or tilted as no vehicle that is flown does."""
    met_m_s = (touchdown_m_s(path), slide_m_s(path))
    return largest(path.tilt_rad) > CRASH_TILT_RAD or any(v > CRASH_SPEED_M_S for v in met_m_s)


def touchdown_m_s(path: TruePath) -> float:
    """The fastest sinking with which it met the ground; NaN if it did not."""
    return max((float((-v[:, 2]).max()) for v in _touches(path)), default=math.nan)


def slide_m_s(path: TruePath) -> float:
    """The fastest sideways motion with which it met the ground; NaN if it did not."""
    fastest = (float(np.hypot(v[:, 0], v[:, 1]).max()) for v in _touches(path))
    return max(fastest, default=math.nan)


def _touches(path: TruePath) -> list[np.ndarray]:
    """The velocities just before each touch of the ground."""
    if not len(path.time_s):
        return []
    low = path.position_enu_m[:, 2] - path.position_enu_m[0, 2] < _GROUND_M
    touches = np.flatnonzero(low[1:] & ~low[:-1]) + 1
    first = np.searchsorted(path.time_s, path.time_s[touches] - _BEFORE_TOUCH_S)
    return [
        path.velocity_enu_m_s[begin : touch + 1]
        for begin, touch in zip(first.tolist(), touches.tolist(), strict=True)
    ]


def largest(values: np.ndarray) -> float:
    """NaN of none."""
    finite = values[np.isfinite(values)]
    return float(finite.max()) if len(finite) else math.nan
