"""JSON Schemas of the messages that Foxglove knows how to draw.

Foxglove finds them by their names (https://docs.foxglove.dev/docs/sdk/schemas).  What is never
written here is said only as far as a message needs it.
"""

from typing import Any

Json = dict[str, Any]


def _object(title: str, about: str, **properties: Json) -> Json:
    return {"title": title, "description": about, "type": "object", "properties": properties}


def _number(about: str) -> Json:
    return {"type": "number", "description": about}


def _text(about: str) -> Json:
    return {"type": "string", "description": about}


def _list(of: Json, about: str) -> Json:
    return {"type": "array", "items": of, "description": about}


def _stamp(title: str, about: str) -> Json:
    return _object(
        title,
        about,
        sec={"type": "integer", "minimum": 0},
        nsec={"type": "integer", "minimum": 0, "maximum": 999_999_999},
    )


def _time(about: str) -> Json:
    return _stamp("time", about)


_VECTOR = _object("foxglove.Vector3", "[m]", x=_number("[m]"), y=_number("[m]"), z=_number("[m]"))
_POINT = _VECTOR | {"title": "foxglove.Point3"}
_QUATERNION = _object(
    "foxglove.Quaternion", "rotation", x=_number(""), y=_number(""), z=_number(""), w=_number("")
)
_POSE = _object("foxglove.Pose", "place and rotation", position=_VECTOR, orientation=_QUATERNION)
_COLOR = _object(
    "foxglove.Color", "0..1", r=_number("red"), g=_number("green"), b=_number("blue"),
    a=_number("opacity"),
)  # fmt: skip
_ANYTHING: Json = {"type": "object", "properties": {}}
_ARROW = _object(
    "foxglove.ArrowPrimitive",
    "an arrow along x",
    pose=_POSE,
    shaft_length=_number("[m]"),
    shaft_diameter=_number("[m]"),
    head_length=_number("[m]"),
    head_diameter=_number("[m]"),
    color=_COLOR,
)
_LINE = _object(
    "foxglove.LinePrimitive",
    "points joined by lines",
    type={
        "title": "foxglove.LineType",
        "description": "how the points are joined",
        "oneOf": [
            {"title": "LINE_STRIP", "const": 0},
            {"title": "LINE_LOOP", "const": 1},
            {"title": "LINE_LIST", "const": 2},
        ],
    },
    pose=_POSE,
    thickness=_number("[m], or pixels if it keeps its size on the screen"),
    scale_invariant={"type": "boolean", "description": "it keeps its size on the screen"},
    points=_list(_POINT, "[m]"),
    color=_COLOR,
    colors=_list(_COLOR, "of each point; empty: one for all"),
    indices=_list({"type": "integer", "minimum": 0}, "of the points; empty: in order"),
)
_ENTITY = _object(
    "foxglove.SceneEntity",
    "a thing in the scene",
    timestamp=_time(""),
    frame_id=_text("frame of the poses"),
    id=_text("one of the same id takes its place"),
    lifetime=_stamp("duration", "0: until it is replaced"),
    frame_locked={"type": "boolean", "description": "it moves with its frame"},
    metadata=_list(_ANYTHING, ""),
    arrows=_list(_ARROW, ""),
    lines=_list(_LINE, ""),
    **{
        kind: _list(_ANYTHING, "")
        for kind in ("cubes", "spheres", "cylinders", "triangles", "texts", "models")
    },
)

SCHEMAS: dict[str, Json] = {
    "foxglove.FrameTransform": _object(
        "foxglove.FrameTransform",
        "where the body frame (FLU: x forward, y left, z up) lies in the world (ENU)",
        timestamp=_time(""),
        parent_frame_id=_text(""),
        child_frame_id=_text(""),
        translation=_VECTOR,
        rotation=_QUATERNION,
    ),
    "foxglove.PoseInFrame": _object(
        "foxglove.PoseInFrame",
        "a place and a rotation",
        timestamp=_time(""),
        frame_id=_text("frame of the pose"),
        pose=_POSE,
    ),
    "foxglove.SceneUpdate": _object(
        "foxglove.SceneUpdate",
        "things in the scene",
        deletions=_list(_ANYTHING, ""),
        entities=_list(_ENTITY, ""),
    ),
    "foxglove.Log": _object(
        "foxglove.Log",
        "what a person was told",
        timestamp=_time(""),
        level={
            "title": "foxglove.LogLevel",
            "description": "how bad it is",
            "oneOf": [
                {"title": name, "const": level}
                for level, name in enumerate(
                    ("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL")
                )
            ],
        },
        message=_text(""),
        name=_text("who said it: companion or autopilot"),
        file=_text(""),
        line={"type": "integer", "minimum": 0, "description": ""},
    ),
    "foxglove.LocationFix": _object(
        "foxglove.LocationFix",
        "where the autopilot takes itself to be (GLOBAL_POSITION_INT)",
        timestamp=_time(""),
        frame_id=_text(""),
        latitude=_number("[degrees]"),
        longitude=_number("[degrees]"),
        altitude=_number("[m] above mean sea level"),
        position_covariance=_list(_number(""), "[m²]; not known"),
        position_covariance_type={
            "title": "foxglove.PositionCovarianceType",
            "description": "0: not known",
            "oneOf": [{"title": "UNKNOWN", "const": 0}],
        },
    ),
    "companion.Tracking": _object(
        "companion.Tracking",
        "figures made of a control record",
        error_mm=_number("|y2* - y2| as the autopilot reported it [mm]"),
        tilt_deg=_number("of the body against the vertical [degrees]"),
        speed_m_s=_number("as the autopilot reported it [m/s]"),
    ),
}
