"""A flight as its pages see it: followed item by item, live or from its log."""

import json
from collections.abc import Iterable, Iterator, Mapping
from heapq import merge
from operator import itemgetter
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from companion.config.resolve import FlightConfig
from companion.flight.assemble import recorded_trajectory
from companion.flight.configuration_record import recorded_configuration
from companion.flight.records import CONFIGURATION, CONTROL, EVENT, INPUT, PLAN
from companion.flight.setpoints.inputs import ENGAGE, START, timeline_from
from companion.live.feed import INTERVAL_S, PACKET, RECORD
from companion.live.frames import FrameMaker
from companion.live.scene import (
    desired_path,
    flight_object,
    geofence,
    horizon_s,
    short_result,
)
from companion.recording.flight_files import FlightFiles, FlightFilesError, flight_files
from companion.trajectories.from_file import TrajectoryFileError
from companion.trajectories.trajectory import Trajectory

MOST_FRAMES = 20_000
_USUAL_RATE_HZ = 100.0
_SEVERITIES = ("info", "warning", "error")
_RESULT = "result.json"

Item = tuple[str, float, Any, Any]
"""Kind, time, and for a record its topic and values; for a packet its bytes and nothing."""


class RecordedFlightError(Exception):
    """A log can't be shown; the text says which, why, and what to do."""


class Watched:
    """What is known of a flight so far: its Flight, Frames and Messages (docs/live.md)."""

    def __init__(self, configuration: Mapping[str, Any] | None, mode: str) -> None:
        """Begin.

        Args:
            configuration: the log's record of that name, if there is one.
            mode: "live" or "recorded".
        """
        self.config, self._trajectory = _configuration(configuration)
        config = self.config
        system_id = None if config is None else config.mission.link.system_id
        rate_hz = _USUAL_RATE_HZ if config is None else config.mission.state_rate_hz
        self.maker = FrameMaker(system_id, horizon_s(config), rate_hz)
        self.flight = flight_object(config, mode)
        self.frames: list[dict[str, Any]] = []
        self.messages: list[dict[str, Any]] = []
        self.flight_changed = False
        """Since it was looked at last; who looks sets it back."""
        self.begun_s: float | None = None

    def take(self, item: Item) -> dict[str, Any] | None:
        """Follow a record or a packet; gives the Message that it is, if it is one."""
        kind, time_s, what, values = item
        if self.begun_s is None:
            self.begun_s = time_s
        if kind == PACKET:
            self.maker.on_packet(time_s, what)
        elif what == CONTROL.topic:
            self.maker.on_control(time_s, values)
        elif what == PLAN.topic:
            self.maker.on_plan(time_s, values)
        elif what == INPUT.topic and values.get("kind") == START:
            self.maker.on_pause()
        elif what == INPUT.topic and values.get("kind") == ENGAGE:
            self._engage(time_s, values["values"])
        elif what == EVENT.topic:
            return self._tell(time_s, values)
        return None

    def look(self, time_s: float) -> dict[str, Any]:
        """Make the Frame of now, and keep it."""
        frame = self.maker.frame(time_s, self.begun_s or 0.0)
        self.frames.append(frame)
        if len(self.frames) > MOST_FRAMES:
            half = len(self.frames) // 2
            self.frames = self.frames[:half:2] + self.frames[half:]
        if self.maker.autopilot is not None and self.flight["autopilot"] is None:
            self._change(autopilot=self.maker.autopilot)
            made = flight_object(self.config, self.flight["mode"], autopilot=self.maker.autopilot)
            self._change(title=made["title"])
        return frame

    def _tell(self, time_s: float, values: Mapping[str, Any]) -> dict[str, Any]:
        severity, text = values.get("severity"), str(values.get("text") or "")
        self.maker.on_event(text)
        message = {
            "t": round(time_s - (self.begun_s or 0.0), 4),
            "severity": severity if severity in _SEVERITIES else "info",
            "text": text,
        }
        self.messages.append(message)
        return message

    def _engage(self, time_s: float, values: Mapping[str, Any]) -> None:
        """The controller takes over: where its path and its box lie is known."""
        if self._trajectory is None or self.config is None:
            return
        try:
            timeline = timeline_from(values, self._trajectory)
        except KeyError:
            return  # of another version: shown without its path
        self.maker.timeline = timeline
        scene = self.flight["scene"]
        anchor = values.get("anchor_enu_m") or (0.0, 0.0, 0.0)
        offset_s = time_s - timeline.start_s - (self.begun_s or 0.0)
        begin_s, end_s = timeline.scored_s
        self._change(
            scored_s=[begin_s + offset_s, end_s + offset_s],
            scene={
                **scene,
                "geofence": geofence(self.config, anchor),
                "desired_enu_m": desired_path(timeline),
            },
        )

    def _change(self, **values: Any) -> None:  # noqa: ANN401 - JSON
        self.flight = {**self.flight, **values}
        self.flight_changed = True

    def end(self, result: Mapping[str, Any] | None, time_s: float | None) -> None:
        """The flight is over."""
        self._change(
            commands=False,
            duration_s=None if time_s is None else time_s - (self.begun_s or 0.0),
            result=result,
        )


def watch_recorded(folder: Path) -> Watched:
    """Follow a recorded flight to its end.

    Args:
        folder: of its logs, or one of them, finished or cut off; what was recovered of one is
            read in its place.

    Raises:
        RecordedFlightError: there are none, or they are damaged.
    """
    try:
        files = flight_files(folder)
        first = next(files.records(), None)
        configuration = None
        if first is not None and first.topic == CONFIGURATION.topic:
            configuration = first.values
        watched = Watched(configuration, "recorded")
        due_s, time_s = -float("inf"), None
        for item in _items(files):
            time_s = item[1]
            if time_s >= due_s:
                if watched.begun_s is not None:
                    watched.look(time_s)
                due_s = time_s + INTERVAL_S
            watched.take(item)
    except FlightFilesError as error:
        raise RecordedFlightError(str(error)) from error
    if not watched.frames:
        raise RecordedFlightError(f"{folder}: nothing was recorded in this flight.")
    result = _result(files.folder)
    watched.end(None if result is None else short_result(result), time_s)
    return watched


def _items(files: FlightFiles) -> Iterator[Item]:
    """Records and packets that came in, in the order of their times."""
    records: Iterable[Item] = ((RECORD, r.time_s, r.topic, r.values) for r in files.records())
    packets: Iterable[Item] = (
        (PACKET, files.log_time_s(packet), packet.raw, None)
        for packet in files.packets()
        if not packet.sent
    )
    return merge(records, packets, key=itemgetter(1))


def _result(folder: Path) -> Mapping[str, Any] | None:
    try:
        read = json.loads((folder / _RESULT).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return read if isinstance(read, dict) else None


def _configuration(
    values: Mapping[str, Any] | None,
) -> tuple[FlightConfig | None, Trajectory | None]:
    """Configuration and trajectory of a record; None where this version can't read them."""
    if values is None:
        return None, None
    try:
        config = recorded_configuration(dict(values))
    except (KeyError, ValidationError):
        return None, None
    try:
        return config, recorded_trajectory(config, values.get("trajectory_file") or "")
    except (TrajectoryFileError, OSError, KeyError):
        return config, None
