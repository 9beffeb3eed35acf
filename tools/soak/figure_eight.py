"""A figure-eight that is flown lap after lap, as a trajectory file."""

import math
from pathlib import Path

LAP_S = 20.0
_HALF_LENGTH_M, _HALF_WIDTH_M, _HALF_HEIGHT_M = 1.6, 0.8, 0.2
_CENTRE_M = (0.0, 0.0, 2.2)
_EASE_S = 5.0
"""How long it takes to get going, and to come to rest."""
_STEP_S = 0.5
_SHORTEST_S = 2.0 * _EASE_S
LONGEST_S = 3600.0
"""No longer trajectory is taken from a file."""


def figure_eight(duration_s: float) -> list[tuple[float, float, float, float]]:
    """Timed waypoints (t, x, y, z), s and m ENU, from rest to rest.

    Slow (0.6 m/s at most) and within the default geofence, of every vehicle that is shipped.

    Raises:
        ValueError: too short to get going and stop again, or too long for a file.
    """
    if not _SHORTEST_S <= duration_s <= LONGEST_S:
        raise ValueError(
            f"a figure-eight of {duration_s:g} s: give {_SHORTEST_S:g} to {LONGEST_S:g} s"
        )
    steps = math.ceil(duration_s / _STEP_S)
    return [_point(duration_s * k / steps, duration_s) for k in range(steps + 1)]


def write_figure_eight(path: Path, duration_s: float) -> None:
    """Write one as CSV.

    Raises:
        ValueError: see `figure_eight`.
        OSError: the file cannot be written.
    """
    rows = [",".join(f"{value:.6f}" for value in point) for point in figure_eight(duration_s)]
    path.write_text("t,x,y,z\n" + "\n".join(rows) + "\n")


def _point(time_s: float, duration_s: float) -> tuple[float, float, float, float]:
    angle = 2.0 * math.pi * _eased_s(time_s, duration_s) / LAP_S
    x, y, z = _CENTRE_M
    return (
        time_s,
        x + _HALF_LENGTH_M * math.sin(angle),
        y + _HALF_WIDTH_M * math.sin(2.0 * angle),
        z + _HALF_HEIGHT_M * math.sin(angle),
    )


def _eased_s(time_s: float, duration_s: float) -> float:
    """Time along the curve: its rate rises from 0 to 1, and falls again, without a kink."""
    before = _integral(min(time_s, _EASE_S))
    between = min(max(0.0, time_s - _EASE_S), duration_s - 2.0 * _EASE_S)
    rest = max(0.0, time_s - (duration_s - _EASE_S))
    return before + between + _integral(_EASE_S) - _integral(_EASE_S - rest)


def _integral(time_s: float) -> float:
    """Of the rate 6 u⁵ - 15 u⁴ + 10 u³ over the beginning, u being the share of the ease."""
    u = time_s / _EASE_S
    return _EASE_S * (u**6 - 3.0 * u**5 + 2.5 * u**4)
