"""Trajectories from a file of timed waypoints: CSV with the header ``t,x,y,z``, or YAML.

The points are joined by a quintic spline that starts and ends at rest, so that velocity and
acceleration are fitted, not differenced.
"""

import csv
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from companion.trajectories.trajectory import Array, Motion

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_COLUMNS = ("t", "x", "y", "z")


class TrajectoryFileError(ValueError):
    """A trajectory file can't be used; the text names file, line and remedy."""


@dataclass(frozen=True)
class SplineTrajectory:
    """Waypoints joined by a quintic spline, at rest at both ends."""

    name: str
    times_s: tuple[float, ...]
    points_m: tuple[tuple[float, float, float], ...]

    @property
    def scored_s(self) -> float:
        """The whole trajectory is scored, s."""
        return self.times_s[-1]

    @property
    def end_s(self) -> float:
        """Time of the last point, s."""
        return self.times_s[-1]

    @cached_property
    def _spline(self) -> "BSpline":
        from scipy.interpolate import make_interp_spline

        rest = [(1, np.zeros(3)), (2, np.zeros(3))]
        return make_interp_spline(
            np.array(self.times_s), np.array(self.points_m), k=5, bc_type=(rest, rest)
        )

    def position(self, times_s: Array) -> Array:
        """Desired positions (samples, 3) in metres, ENU."""
        inside = np.clip(times_s, 0.0, self.end_s)
        position: Array = self._spline(inside)
        return position

    def motion(self, times_s: Array) -> Motion:
        """Desired positions, velocities and accelerations (samples, 3), ENU."""
        inside = np.clip(times_s, 0.0, self.end_s)
        moving = ((times_s >= 0.0) & (times_s <= self.end_s))[:, None]
        return Motion(
            self._spline(inside),
            np.where(moving, self._spline(inside, nu=1), 0.0),
            np.where(moving, self._spline(inside, nu=2), 0.0),
        )


def load_trajectory(path: Path) -> SplineTrajectory:
    """Read a trajectory file; its kind is told by its suffix (.csv, .yaml, .yml).

    YAML holds ``name`` (optional) and ``points``: a list of ``[t, x, y, z]``.  Times are seconds
    from 0 and rise; positions are metres, ENU.

    Raises:
        TrajectoryFileError: unreadable, malformed, not finite, or times that do not rise.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise TrajectoryFileError(
            f"{path}: the trajectory file can't be read ({error}). Give a CSV with the header "
            "t,x,y,z or a YAML file with `points`."
        ) from error
    if path.suffix.lower() == ".csv":
        name, rows = path.stem, _rows_from_csv(path, text)
    elif path.suffix.lower() in (".yaml", ".yml"):
        name, rows = _rows_from_yaml(path, text)
    else:
        raise TrajectoryFileError(
            f"{path}: unknown kind of trajectory file '{path.suffix}'. Use .csv, .yaml or .yml."
        )
    return _checked(path, name, rows)


def _rows_from_csv(path: Path, text: str) -> list[tuple[int, list[Any]]]:
    lines = [
        (number, row) for number, row in enumerate(csv.reader(text.splitlines()), 1) if any(row)
    ]
    if not lines or tuple(c.strip() for c in lines[0][1]) != _COLUMNS:
        raise TrajectoryFileError(f"{path}, line 1: the header must be t,x,y,z (s, m, m, m; ENU).")
    return [(number, list(row)) for number, row in lines[1:]]


def _rows_from_yaml(path: Path, text: str) -> tuple[str, list[tuple[int, list[Any]]]]:
    try:
        content = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError) as error:
        raise TrajectoryFileError(f"{path}: not YAML: {error}") from error
    if not isinstance(content, dict) or not isinstance(content.get("points"), list):
        raise TrajectoryFileError(
            f"{path}: give `points`, a list of [t, x, y, z] (s, m, m, m; ENU)."
        )
    unknown = sorted(str(key) for key in set(content) - {"name", "points"})
    if unknown:
        raise TrajectoryFileError(
            f"{path}: unknown key '{unknown[0]}'. A trajectory has `name` and `points`."
        )
    rows = [
        (number, point if isinstance(point, list) else [point])
        for number, point in enumerate(content["points"], 1)
    ]
    return str(content.get("name", path.stem)), rows


def _checked(path: Path, name: str, rows: list[tuple[int, list[Any]]]) -> SplineTrajectory:
    times: list[float] = []
    points: list[tuple[float, float, float]] = []
    for number, row in rows:
        where = f"{path}, point in line {number}" if path.suffix == ".csv" else f"{path}, {number}."
        try:
            t, x, y, z = (float(value) for value in row)
        except (TypeError, ValueError) as error:
            raise TrajectoryFileError(f"{where}: {row} is not four numbers t, x, y, z.") from error
        if not all(math.isfinite(value) for value in (t, x, y, z)):
            raise TrajectoryFileError(f"{where}: {row} is not finite.")
        if times and t <= times[-1]:
            raise TrajectoryFileError(
                f"{where}: time {t:g} s does not come after {times[-1]:g} s. Sort the points by t."
            )
        times.append(t)
        points.append((x, y, z))
    if len(times) < 2:
        raise TrajectoryFileError(f"{path}: at least two points are needed, {len(times)} found.")
    first = times[0]
    return SplineTrajectory(name, tuple(t - first for t in times), tuple(points))
