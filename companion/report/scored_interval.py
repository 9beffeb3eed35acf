"""Between which times a recorded flight is scored: by when its controller was engaged."""

from collections.abc import Mapping, Sequence
from typing import Any

from companion.flight.records import INPUT
from companion.flight.setpoints.inputs import ENGAGE
from companion.recording.mcap_log import LogRecord
from companion.trajectories.harmonic import TEST_TRAJECTORIES


def engagement_of(inputs: Sequence[LogRecord]) -> Mapping[str, Any] | None:
    """What the controller was engaged with, from the records of the channel `input`.

    The last time: what is scored is what was flown after it.  None if it never was.
    """
    found = None
    for record in inputs:
        if record.topic == INPUT.topic and record.values.get("kind") == ENGAGE:
            found = record.values["values"]
    return found


def scored_interval_s(
    engagement: Mapping[str, Any] | None, trajectory: object
) -> tuple[float, float] | None:
    """The autopilot's times between which tracking is scored; None without an engagement.

    Args:
        engagement: from `engagement_of`.
        trajectory: of the mission: a number, a path, or a name.

    Raises:
        KeyError, TypeError, ValueError, IndexError: it is not what this version records.
    """
    if engagement is None:
        return None
    begins = [*engagement["begins_s"], engagement["end_s"]]
    for index, segment in enumerate(engagement["segments"]):
        if "heading_rad" in segment:
            begin_s = float(engagement["start_s"]) + float(begins[index])
            length_s = segment.get("scored_s")
            if length_s is None:  # a log of before that was recorded
                known = TEST_TRAJECTORIES.get(trajectory) if isinstance(trajectory, int) else None
                length_s = begins[index + 1] - begins[index] if known is None else known.scored_s
            return begin_s, begin_s + float(length_s)
    return None
