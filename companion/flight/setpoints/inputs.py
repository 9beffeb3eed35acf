"""What the control loop is told besides samples: as records, and back from them.

Together with the packets and the records of the ticks they are all that a flight's setpoints follow
from, so that it can be replayed (`companion.flight.replay`).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from companion.control.reference_model import Array
from companion.flight.setpoints.placement import PlacedTrajectory, Placement
from companion.flight.setpoints.timeline import Move, Segment, Timeline, Track
from companion.frames import Quaternion, Vector3
from companion.thrust_meaning import ThrustMeaning
from companion.trajectories.trajectory import Trajectory

ADOPT, START, ENGAGE, HOLD = "adopt", "start", "engage", "hold"
"""Kinds: other stacks; the stream begins, holding; the controller takes over; what holds the
vehicle while it is handed over."""


def adopt_values(thrust: ThrustMeaning) -> dict[str, Any]:
    """The stacks are made anew, for what the autopilot makes of the thrust field."""
    return {
        "thrust_kind": thrust.kind,
        "climb_m_s": thrust.climb_m_s,
        "descent_m_s": thrust.descent_m_s,
    }


def thrust_meaning_from(values: Mapping[str, Any]) -> ThrustMeaning:
    """Back from `adopt_values`.

    Raises:
        KeyError: a value is missing.
    """
    return ThrustMeaning(values["thrust_kind"], values["climb_m_s"], values["descent_m_s"])


def engage_values(timeline: Timeline, yaw_rad: float, anchor_enu_m: Vector3) -> dict[str, Any]:
    """The controller takes over.

    Args:
        timeline: its reference; trajectories in it are placed ones.
        yaw_rad: desired, ENU.
        anchor_enu_m: what the geofence lies about.
    """
    return {
        "start_s": timeline.start_s,
        "segments": [_segment_values(segment) for segment in timeline.segments],
        "begins_s": list(timeline.begins_s),
        "end_s": timeline.end_s,
        "yaw_rad": yaw_rad,
        "anchor_enu_m": list(anchor_enu_m),
    }


def timeline_from(values: Mapping[str, Any], trajectory: Trajectory) -> Timeline:
    """The reference back from `engage_values`.

    Args:
        values: the record's.
        trajectory: the mission's, not placed.

    Raises:
        KeyError: a value is missing.
    """
    return Timeline(
        values["start_s"],
        tuple(_segment_from(segment, trajectory) for segment in values["segments"]),
        tuple(values["begins_s"]),
        values["end_s"],
    )


def hold_values(level: tuple[Quaternion, float]) -> dict[str, Any]:
    """Attitude and thrust that hold the vehicle while it is handed over."""
    attitude, thrust = level
    return {"attitude_flu_to_enu": list(attitude), "thrust": thrust}


def _segment_values(segment: Segment) -> dict[str, Any]:
    if isinstance(segment, Move):
        return {
            "phase": segment.phase,
            "from_m": _floats(segment.from_m),
            "to_m": _floats(segment.to_m),
            "duration_s": segment.duration_s,
        }
    placed = segment.trajectory
    assert isinstance(placed, PlacedTrajectory)
    return {
        "phase": segment.phase,
        "scored_s": placed.scored_s,
        "anchor_enu_m": list(placed.placement.anchor_enu_m),
        "origin_enu_m": list(placed.placement.origin_enu_m),
        "heading_rad": placed.placement.heading_rad,
    }


def _segment_from(values: Mapping[str, Any], trajectory: Trajectory) -> Segment:
    if "duration_s" in values:
        return Move(
            values["phase"],
            np.array(values["from_m"]),
            np.array(values["to_m"]),
            values["duration_s"],
        )
    placement = Placement(
        tuple(values["anchor_enu_m"]), tuple(values["origin_enu_m"]), values["heading_rad"]
    )
    return Track(values["phase"], PlacedTrajectory(trajectory, placement))


def _floats(vector: Array) -> list[float]:
    floats: list[float] = vector.tolist()
    return floats
