"""What stands still in a picture of a flight: the desired and the flown path, the geofence."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from companion.export.errors import ExportError
from companion.export.source import Tell
from companion.recording.flight_files import FlightFiles

Point = tuple[float, float, float]

MOST_POINTS = 3000
"""Of a path.  More cannot be seen, and a viewer draws all of them at every frame."""
TRACKED = "track"
"""Phase in which the trajectory is flown."""
_TOLD_EACH = 2000


class ThinnedPath:
    """Points of a path of any length: evenly thinned, so that a bounded number is kept."""

    __slots__ = ("_points", "_seen", "_stride")

    def __init__(self) -> None:
        """Begin with none."""
        self._points: list[Point] = []
        self._stride = 1
        self._seen = 0

    def add(self, point: Point) -> None:
        """Add the next point."""
        if self._seen % self._stride == 0:
            self._points.append(point)
            if len(self._points) > MOST_POINTS:
                del self._points[1::2]
                self._stride *= 2
        self._seen += 1

    @property
    def points(self) -> list[Point]:
        """Those that are kept, in order."""
        return list(self._points)


@dataclass(frozen=True, slots=True)
class Scene:
    """What stands still, world ENU, m."""

    flown_enu_m: list[Point]
    """As the autopilot reported it."""
    desired_enu_m: list[Point]
    """y2* of the part that is tracked; of all that was flown, if none was."""
    geofence_enu_m: tuple[Point, Point] | None
    """Its lowest and its highest corner, where it lies in the autopilot's local frame."""
    begin_ns: int
    """Time of the log's first record, nanoseconds since 1970."""
    records: int


def scene_of(files: FlightFiles, tell: Tell) -> Scene:
    """Read all records once, for what stands still.

    Raises:
        FlightFilesError: the log cannot be read.
    """
    flown, tracked, desired = ThinnedPath(), ThinnedPath(), ThinnedPath()
    box: dict[str, Sequence[float]] | None = None
    anchor: Sequence[float] | None = None
    begin_ns = count = 0
    for count, record in enumerate(files.records(), 1):
        values = record.values
        if count == 1:
            begin_ns = files.log_time_ns(record)
        if count % _TOLD_EACH == 0:
            tell("records read", count, None)
        if record.topic == "control":
            _add(flown, values.get("position_enu_m"))
            wanted = values.get("desired_enu_m")
            _add(desired, wanted)
            if values.get("phase") == TRACKED:
                _add(tracked, wanted)
        elif record.topic == "input" and values.get("kind") == "engage":
            anchor = values.get("values", {}).get("anchor_enu_m")
        elif record.topic == "configuration":
            box = (values.get("mission") or {}).get("geofence")
    if not count:
        raise ExportError(f"{files.mcap} holds no records: there is nothing to export.")
    return Scene(
        flown.points, tracked.points or desired.points, _placed(box, anchor), begin_ns, count
    )


def point_of(value: Any) -> Point | None:  # noqa: ANN401 - of a log
    """A vector of a record; None if it is not known."""
    if value is None or len(value) != 3 or None in value:
        return None
    x, y, z = value
    return (x, y, z)


def tilt_deg(attitude_flu_to_enu: Sequence[float]) -> float:
    """Angle between the body's upward axis and the vertical.

    Args:
        attitude_flu_to_enu: w, x, y, z.
    """
    _, x, y, _ = attitude_flu_to_enu
    return math.degrees(math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (x * x + y * y)))))


def _add(path: ThinnedPath, value: Any) -> None:  # noqa: ANN401 - of a log
    point = point_of(value)
    if point is not None:
        path.add(point)


def _placed(
    box: dict[str, Sequence[float]] | None, anchor: Sequence[float] | None
) -> tuple[Point, Point] | None:
    if not box or anchor is None:
        return None
    low, high = (
        tuple(a + b for a, b in zip(anchor, box[key], strict=True)) for key in ("low_m", "high_m")
    )
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])
