"""A way to and fro about the hover point, along x and y at once, of different periods.

It grows out of the hover point and shrinks back into it.  Large and slow: what a tilt pushes and
what the air brakes must rise above an estimate that wanders by some 0.2 m/s.
"""

import math
from dataclasses import dataclass

_PERIODS_S = (4.5, 5.6)
_GROWS_S = 3.0
_BASE_S = 0.02
"""Half the base of the differences that velocity and acceleration are taken by."""

Vector2 = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Swing:
    """``R sin(2π t / 4.5 s)`` along x (east), ``R sin(2π t / 5.6 s)`` along y (north)."""

    radius_m: float
    duration_s: float

    @property
    def top_speed_m_s(self) -> float:
        """Where both run fastest at once."""
        return 2.0 * math.pi * self.radius_m * math.hypot(*(1.0 / p for p in _PERIODS_S))

    def position_m(self, since_s: float) -> Vector2:
        """Offset from the hover point, this long after it began."""
        left_s = self.duration_s - since_s
        size = self.radius_m * _smooth(since_s / _GROWS_S) * _smooth(left_s / _GROWS_S)
        x, y = (size * math.sin(2.0 * math.pi * since_s / period) for period in _PERIODS_S)
        return x, y

    def motion(self, since_s: float) -> tuple[Vector2, Vector2, Vector2]:
        """Position, velocity and acceleration: m, m/s, m/s²."""
        before, now, after = (self.position_m(since_s + k * _BASE_S) for k in (-1, 0, 1))
        vx, vy = ((b - a) / (2.0 * _BASE_S) for a, b in zip(before, after, strict=True))
        ax, ay = (
            (a - 2.0 * n + b) / _BASE_S**2 for a, n, b in zip(before, now, after, strict=True)
        )
        return now, (vx, vy), (ax, ay)


def _smooth(share: float) -> float:
    """From 0 to 1 with no jump of the acceleration."""
    s = max(0.0, min(1.0, share))
    return s * s * s * (10.0 + s * (-15.0 + 6.0 * s))
