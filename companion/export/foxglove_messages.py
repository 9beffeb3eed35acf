"""Messages that Foxglove knows how to draw, of what a flight's records and packets say."""

import math
from collections.abc import Sequence
from typing import Any

from companion.export.scene import Point, Scene, point_of, tilt_deg

Json = dict[str, Any]

WORLD = "world"
BODY = "body"
_ARM_M = 0.18
_NO_TURN: Json = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
_HERE: Json = {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": _NO_TURN}
_DESIRED = (0.95, 0.62, 0.10, 1.0)
_FLOWN = (0.25, 0.56, 0.96, 1.0)
_FENCE = (0.60, 0.60, 0.60, 0.6)
_VEHICLE = (0.90, 0.90, 0.90, 1.0)
_FORWARD = (0.92, 0.30, 0.24, 1.0)
_LINE_STRIP, _LINE_LIST = 0, 2
_LEVELS = {"debug": 1, "info": 2, "warning": 3, "error": 4}
_STATUSTEXT_LEVELS = (5, 5, 4, 4, 3, 2, 2, 1)
"""Of MAV_SEVERITY 0 (emergency) … 7 (debug)."""


def stamp(time_ns: int) -> Json:
    """A time as Foxglove has it."""
    return {"sec": time_ns // 1_000_000_000, "nsec": time_ns % 1_000_000_000}


def pose(time_ns: int, position: Point, attitude: Sequence[float] | None) -> Json:
    """A foxglove.PoseInFrame in the world.

    Args:
        time_ns: since 1970.
        position: ENU, m.
        attitude: FLU to ENU, w, x, y, z; None: not turned.
    """
    return {
        "timestamp": stamp(time_ns),
        "frame_id": WORLD,
        "pose": {"position": _xyz(position), "orientation": _rotation(attitude)},
    }


def transform(time_ns: int, position: Point, attitude: Sequence[float]) -> Json:
    """A foxglove.FrameTransform from the world to the body; arguments as of `pose`."""
    return {
        "timestamp": stamp(time_ns),
        "parent_frame_id": WORLD,
        "child_frame_id": BODY,
        "translation": _xyz(position),
        "rotation": _rotation(attitude),
    }


def tracking(values: Json) -> Json | None:
    """Figures of a control record; None if it has no state."""
    position, desired = point_of(values["position_enu_m"]), point_of(values["desired_enu_m"])
    velocity, attitude = point_of(values["velocity_enu_m_s"]), values["attitude_flu_to_enu"]
    if position is None or velocity is None or None in attitude:
        return None
    figures = {"tilt_deg": tilt_deg(attitude), "speed_m_s": math.hypot(*velocity)}
    if desired is not None:
        figures["error_mm"] = math.dist(position, desired) * 1e3
    return figures


def told(time_ns: int, severity: str, text: str) -> Json:
    """A foxglove.Log of what the companion told a person."""
    return _log(time_ns, _LEVELS.get(severity, 0), text, "companion")


def told_by_autopilot(time_ns: int, severity: int, text: str) -> Json:
    """A foxglove.Log of a STATUSTEXT."""
    level = _STATUSTEXT_LEVELS[severity] if severity < len(_STATUSTEXT_LEVELS) else 0
    return _log(time_ns, level, text, "autopilot")


def location(time_ns: int, latitude_deg: float, longitude_deg: float, altitude_m: float) -> Json:
    """A foxglove.LocationFix."""
    return {
        "timestamp": stamp(time_ns),
        "frame_id": BODY,
        "latitude": latitude_deg,
        "longitude": longitude_deg,
        "altitude": altitude_m,
        "position_covariance": [0.0] * 9,
        "position_covariance_type": 0,
    }


def scene_update(scene: Scene) -> Json:
    """A foxglove.SceneUpdate: what stands still, and the vehicle, which moves with its frame."""
    begin = scene.begin_ns
    entities = [
        _entity(begin, "desired path", WORLD, lines=[_strip(scene.desired_enu_m, _DESIRED, 2.0)]),
        _entity(begin, "flown path", WORLD, lines=[_strip(scene.flown_enu_m, _FLOWN, 2.0)]),
        _entity(begin, "vehicle", BODY, lines=[_arms()], arrows=[_nose()]),
    ]
    if scene.geofence_enu_m is not None:
        entities.append(_entity(begin, "geofence", WORLD, lines=[_box(*scene.geofence_enu_m)]))
    return {"deletions": [], "entities": entities}


def _log(time_ns: int, level: int, text: str, name: str) -> Json:
    return {
        "timestamp": stamp(time_ns),
        "level": level,
        "message": text,
        "name": name,
        "file": "",
        "line": 0,
    }


def _entity(time_ns: int, name: str, frame: str, **things: list[Json]) -> Json:
    kinds = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
    return {
        "timestamp": stamp(time_ns),
        "frame_id": frame,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": [],
        **{kind: things.get(kind, []) for kind in kinds},
    }


def _strip(points: Sequence[Point], color: Sequence[float], pixels: float) -> Json:
    return _line(_LINE_STRIP, points, color, pixels)


def _line(kind: int, points: Sequence[Point], color: Sequence[float], pixels: float) -> Json:
    return {
        "type": kind,
        "pose": _HERE,
        "thickness": pixels,
        "scale_invariant": True,
        "points": [_xyz(point) for point in points],
        "color": _rgba(color),
        "colors": [],
        "indices": [],
    }


def _arms() -> Json:
    side = _ARM_M / math.sqrt(2.0)
    corners = [(side, side, 0.0), (-side, -side, 0.0), (side, -side, 0.0), (-side, side, 0.0)]
    return _line(_LINE_LIST, corners, _VEHICLE, 5.0)


def _nose() -> Json:
    return {
        "pose": _HERE,
        "shaft_length": _ARM_M,
        "shaft_diameter": 0.02,
        "head_length": 0.06,
        "head_diameter": 0.05,
        "color": _rgba(_FORWARD),
    }


def _box(low: Point, high: Point) -> Json:
    edges: list[Point] = []
    for axis in range(3):
        one, other = (k for k in range(3) if k != axis)
        for first in (low[one], high[one]):
            for second in (low[other], high[other]):
                for end in (low[axis], high[axis]):
                    corner = [0.0, 0.0, 0.0]
                    corner[axis], corner[one], corner[other] = end, first, second
                    edges.append((corner[0], corner[1], corner[2]))
    return _line(_LINE_LIST, edges, _FENCE, 1.0)


def _xyz(point: Point) -> Json:
    x, y, z = point
    return {"x": x, "y": y, "z": z}


def _rotation(attitude: Sequence[float] | None) -> Json:
    if attitude is None:
        return _NO_TURN
    w, x, y, z = attitude
    return {"x": x, "y": y, "z": z, "w": w}


def _rgba(color: Sequence[float]) -> Json:
    r, g, b, a = color
    return {"r": r, "g": g, "b": b, "a": a}
