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
from companion.yaml_tokens import FAST_LOADER, PARSE_ERRORS, find_flaw

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_COLUMNS = ("t", "x", "y", "z")
_LARGEST_FILE_BYTES = 10_000_000
_SHORTEST_STEP_S = 0.0099
"""Feasibility is checked every 10 ms: points closer than that would escape it."""
_LONGEST_S = 3600.0
_FARTHEST_M = 10_000.0

_DEEPEST = 10

_Row = tuple[str, list[Any]]
"""Where a point stands, for messages, and what stands there."""


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

    def position_at(self, time_s: float) -> tuple[float, float, float]:
        """Desired position at one time, ENU m."""
        x, y, z = self.position(np.array([time_s]))[0].tolist()
        return x, y, z

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
        TrajectoryFileError: unreadable, malformed, not finite, out of all proportion, or times
            that do not rise.
    """
    suffix = path.suffix.lower()
    if suffix not in (".csv", ".yaml", ".yml"):
        raise TrajectoryFileError(
            f"{path}: unknown kind of trajectory file '{path.suffix}'. Use .csv, .yaml or .yml, or "
            "give the number of a test trajectory, 1 to 5."
        )
    text = _text(path)
    if suffix == ".csv":
        return _checked(path.stem, _rows_from_csv(path, text), path)
    name, rows = _rows_from_yaml(path, text)
    return _checked(name, rows, path)


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > _LARGEST_FILE_BYTES:
            raise TrajectoryFileError(f"{path}: larger than 10 MB. Give fewer points.")
        # A byte order mark, as spreadsheets write it, is skipped.
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise TrajectoryFileError(
            f"{path}: the trajectory file can't be read: {error.strerror or error}. Give a CSV "
            "with the header t,x,y,z or a YAML file with `points`."
        ) from error
    except UnicodeDecodeError as error:
        raise TrajectoryFileError(
            f"{path}: the trajectory file can't be read: not UTF-8. Save it as UTF-8."
        ) from error
    except ValueError as error:  # a path with a NUL in it
        raise TrajectoryFileError(f"{str(path)!r}: {error}. Check the path.") from error


def _rows_from_csv(path: Path, text: str) -> list[_Row]:
    try:
        lines = [
            (f"{path}, line {number}", row)
            for number, row in enumerate(csv.reader(text.splitlines()), 1)
            if any(row)
        ]
    except csv.Error as error:
        raise TrajectoryFileError(f"{path}: not CSV: {error}.") from error
    if not lines or tuple(c.strip() for c in lines[0][1]) != _COLUMNS:
        raise TrajectoryFileError(f"{path}, line 1: the header must be t,x,y,z (s, m, m, m; ENU).")
    return [(where, list(row)) for where, row in lines[1:]]


def _rows_from_yaml(path: Path, text: str) -> tuple[str, list[_Row]]:
    try:
        try:
            content = _from_yaml(FAST_LOADER, path, text)
        except PARSE_ERRORS as error:
            if isinstance(error, TrajectoryFileError):
                raise
            content = _from_yaml(yaml.SafeLoader, path, text)  # it says better what is wrong
    except TrajectoryFileError:
        raise
    except PARSE_ERRORS as error:
        raise TrajectoryFileError(f"{path}: not YAML: {error}") from error
    if not isinstance(content, dict) or not isinstance(content.get("points"), list):
        raise TrajectoryFileError(
            f"{path}: give `points`, a list of [t, x, y, z] (s, m, m, m; ENU)."
        )
    unknown = sorted(str(key) for key in content if key not in ("name", "points"))
    if unknown:
        raise TrajectoryFileError(
            f"{path}: unknown key '{unknown[0]}'. A trajectory has `name` and `points`."
        )
    name = content.get("name", path.stem)
    if not isinstance(name, str):
        raise TrajectoryFileError(f"{path}: `name` is not text: {name!r}. Write it in quotes.")
    rows = [
        (f"{path}, point {number}", point if isinstance(point, list) else [point])
        for number, point in enumerate(content["points"], 1)
    ]
    return name, rows


def _from_yaml(loader: Any, path: Path, text: str) -> Any:  # noqa: ANN401 - PyYAML's, any value
    """Values of a text whose tokens show that it does not grow without end."""
    flaw = find_flaw(text, loader, _DEEPEST)
    if flaw is not None and flaw.kind == "alias":
        raise TrajectoryFileError(f"{path}: YAML aliases (*name) are not taken; write it out.")
    if flaw is not None:
        raise TrajectoryFileError(
            f"{path}, line {flaw.line}: nests deeper than {_DEEPEST} levels. Points are a list of "
            "lists."
        )
    return yaml.load(text, Loader=loader)  # a safe one


def _checked(name: str, rows: list[_Row], path: Path) -> SplineTrajectory:
    times: list[float] = []
    points: list[tuple[float, float, float]] = []
    for where, row in rows:
        t, x, y, z = _numbers(where, row)
        if times and t <= times[-1]:
            raise TrajectoryFileError(
                f"{where}: time {t:g} s does not come after {times[-1]:g} s. Sort the points by t."
            )
        if times and t - times[-1] < _SHORTEST_STEP_S:
            raise TrajectoryFileError(
                f"{where}: less than 10 ms after the point before it. Give fewer points; they are "
                "joined smoothly."
            )
        times.append(t)
        points.append((x, y, z))
    if len(times) < 2:
        raise TrajectoryFileError(
            f"{path}: at least two points are needed, {len(times)} found. Add some."
        )
    first = times[0]
    if times[-1] - first > _LONGEST_S:
        raise TrajectoryFileError(
            f"{path}: takes {times[-1] - first:g} s; at most {_LONGEST_S:g} s are flown. Times are "
            "seconds."
        )
    return SplineTrajectory(name, tuple(t - first for t in times), tuple(points))


def _numbers(where: str, row: list[Any]) -> tuple[float, float, float, float]:
    try:
        if any(isinstance(value, bool) for value in row):
            raise ValueError
        t, x, y, z = (float(value) for value in row)
    except (TypeError, ValueError, OverflowError) as error:
        raise TrajectoryFileError(f"{where}: {row} is not four numbers t, x, y, z.") from error
    if not all(math.isfinite(value) for value in (t, x, y, z)):
        raise TrajectoryFileError(f"{where}: {row} is not finite. Leave that point out.")
    if max(abs(x), abs(y), abs(z)) > _FARTHEST_M:
        raise TrajectoryFileError(
            f"{where}: {row} is farther away than {_FARTHEST_M:g} m. Positions are metres."
        )
    return t, x, y, z
