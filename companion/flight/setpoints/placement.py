"""Where a mission lies in the autopilot's local frame: the trajectory's origin and heading.

Two points matter.  The *anchor* is the place that the geofence lies about: where the vehicle was
after its take-off, at the height of the ground that it stood on, or the local frame's own origin.
The trajectory's *origin* is the anchor moved by the mission's offset.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from companion.config.models import OriginConfig
from companion.frames import Vector3
from companion.trajectories.trajectory import Array, Motion, Trajectory

_LOCAL: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Placement:
    """A mission's place in the autopilot's local frame."""

    anchor_enu_m: Vector3
    """What the geofence lies about; the box itself is not turned."""
    origin_enu_m: Vector3
    """Where the trajectory's origin lies."""
    heading_rad: float
    """Direction of the trajectory's x axis, counter-clockwise from east."""


@dataclass(frozen=True, slots=True)
class PlacedTrajectory:
    """A trajectory turned about the vertical and moved, a `Trajectory` of the local frame."""

    trajectory: Trajectory
    placement: Placement
    _origin: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Keep the origin as an array."""
        object.__setattr__(self, "_origin", np.array(self.placement.origin_enu_m))

    @property
    def name(self) -> str:
        """As of the trajectory."""
        return self.trajectory.name

    @property
    def scored_s(self) -> float:
        """As of the trajectory."""
        return self.trajectory.scored_s

    @property
    def end_s(self) -> float:
        """As of the trajectory."""
        return self.trajectory.end_s

    def position(self, times_s: Array) -> Array:
        """Desired positions (samples, 3) in the local frame, ENU m."""
        return self._turned(self.trajectory.position(times_s)) + self._origin

    def position_at(self, time_s: float) -> Vector3:
        """Desired position at one time in the local frame, ENU m."""
        x, y, z = self.trajectory.position_at(time_s)
        east, north, up = self.placement.origin_enu_m
        heading = self.placement.heading_rad
        if heading != 0.0:
            cosine, sine = math.cos(heading), math.sin(heading)
            x, y = cosine * x - sine * y, sine * x + cosine * y
        return x + east, y + north, z + up

    def motion(self, times_s: Array) -> Motion:
        """Desired positions with velocity and acceleration."""
        motion = self.trajectory.motion(times_s)
        return Motion(
            self._turned(motion.position_m) + self._origin,
            self._turned(motion.velocity_m_s),
            self._turned(motion.acceleration_m_s2),
        )

    def _turned(self, vectors: Array) -> Array:
        """Vectors (samples, 3) turned by the heading; untouched by one of 0."""
        heading = self.placement.heading_rad
        if heading == 0.0:
            return vectors
        cosine, sine = math.cos(heading), math.sin(heading)
        turned = np.array(vectors)
        turned[:, 0] = cosine * vectors[:, 0] - sine * vectors[:, 1]
        turned[:, 1] = sine * vectors[:, 0] + cosine * vectors[:, 1]
        return turned


def place(origin: OriginConfig, takeoff_enu_m: Vector3 | None, yaw_rad: float) -> Placement:
    """The placement that a mission asks for.

    Args:
        origin: of the mission.
        takeoff_enu_m: where the vehicle was after its take-off, at the height of the ground; None
            if it has not taken off (a flight that begins in the air lies in the local frame).
        yaw_rad: the vehicle's, counter-clockwise from east.
    """
    anchor = _LOCAL if takeoff_enu_m is None or origin.at == "local" else takeoff_enu_m
    x, y, z = anchor
    east, north, up = origin.offset_enu_m
    heading = known_heading_rad(origin)
    return Placement(anchor, (x + east, y + north, z + up), yaw_rad if heading is None else heading)


def known_heading_rad(origin: OriginConfig) -> float | None:
    """The heading that a mission states; None if it is the vehicle's at engagement."""
    return None if origin.heading_deg == "vehicle" else math.radians(origin.heading_deg)


def about_anchor(placement: Placement) -> Placement:
    """The same placement as seen from its anchor."""
    (x, y, z), (east, north, up) = placement.anchor_enu_m, placement.origin_enu_m
    return replace(placement, anchor_enu_m=_LOCAL, origin_enu_m=(east - x, north - y, up - z))
