"""A flight as an MCAP file that Foxglove draws in three dimensions.

It holds the controller's records as the flight's own log does, and beside them topics of schemas
that Foxglove knows: a transform, poses, a scene, messages, a location.  They are made here and not
in flight, where they would cost time at each tick and say nothing new.
"""

import heapq
import json
from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path
from typing import Any

import orjson
from mcap.writer import CompressionType, Writer

from companion.export import foxglove_messages as messages
from companion.export.foxglove_schemas import SCHEMAS
from companion.export.packet_tables import read_messages, taken_apart
from companion.export.scene import Scene, point_of, scene_of
from companion.export.source import Tell
from companion.flight.records import CHANNELS
from companion.mavlink.framing import Framer
from companion.mavlink.messages import MessageId
from companion.mavlink.telemetry import Rejected, state_from_odometry
from companion.recording.flight_files import FlightFiles
from companion.recording.json_record import record_json
from companion.recording.mcap_reader import LogRecord
from companion.recording.schema import json_schema, spec_from_record
from companion.recording.tlog import TlogRecord
from companion.report.flight_data import is_truth_packet

TRANSFORM, POSE, TRUE_POSE, DESIRED = "transform", "pose", "true_pose", "desired"
SCENE, MESSAGES, LOCATION, TRACKING = "scene", "messages", "location", "tracking"
_MADE = {
    TRANSFORM: "foxglove.FrameTransform",
    POSE: "foxglove.PoseInFrame",
    TRUE_POSE: "foxglove.PoseInFrame",
    DESIRED: "foxglove.PoseInFrame",
    SCENE: "foxglove.SceneUpdate",
    MESSAGES: "foxglove.Log",
    LOCATION: "foxglove.LocationFix",
    TRACKING: "companion.Tracking",
}
_SPECS = {spec.topic: spec for spec in CHANNELS}
_GLOBAL_POSITION_INT, _STATUSTEXT = 33, 253
_TOLD_EACH = 2000
_Timed = Iterator[tuple[int, LogRecord | TlogRecord]]
"""What a log holds, each with its time in nanoseconds since 1970."""


def write_foxglove(files: FlightFiles, path: Path, tell: Tell) -> dict[str, int]:
    """Write the file; gives the number of messages of each topic.

    Raises:
        FlightFilesError: the log cannot be read.
        OSError: the file cannot be written.
    """
    scene = scene_of(files, tell)
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="", library="companion export")
        log = _Log(writer)
        log.add(SCENE, scene.begin_ns, messages.scene_update(scene))
        _write_all(files, scene, log, tell)
        writer.finish()  # type: ignore[no-untyped-call]
    return log.counts


class _Log:
    """Writes messages; a channel is made when its first one comes."""

    __slots__ = ("_channels", "_schemas", "_writer", "counts")

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self.counts: dict[str, int] = {}

    def add(self, topic: str, time_ns: int, message: dict[str, Any]) -> None:
        """A message of a topic that is made here."""
        if topic not in self._channels:
            name = _MADE[topic]
            self._begin(topic, name, SCHEMAS[name])
        self._write(topic, time_ns, orjson.dumps(message))

    def copy(self, record: LogRecord, time_ns: int) -> None:
        """A record of the flight's log."""
        if record.topic not in self._channels:
            spec = _SPECS.get(record.topic) or spec_from_record(record.topic, record.values)
            self._begin(record.topic, record.topic, json_schema(spec))
        self._write(record.topic, time_ns, record_json(record.values))

    def _begin(self, topic: str, name: str, schema: dict[str, Any]) -> None:
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(
                name, "jsonschema", json.dumps(schema).encode()
            )
        self._channels[topic] = self._writer.register_channel(topic, "json", self._schemas[name])

    def _write(self, topic: str, time_ns: int, data: bytes) -> None:
        self._writer.add_message(self._channels[topic], time_ns, data, time_ns)
        self.counts[topic] = self.counts.get(topic, 0) + 1


def _write_all(files: FlightFiles, scene: Scene, log: _Log, tell: Tell) -> None:
    """Records and packets in the order of time: so a viewer can begin anywhere."""
    framer = Framer()
    records: _Timed = ((files.log_time_ns(record), record) for record in files.records())
    packets: _Timed = ((packet.time_us * 1000, packet) for packet in files.packets())
    done = 0
    for time_ns, item in heapq.merge(records, packets, key=itemgetter(0)):
        if isinstance(item, TlogRecord):
            _add_packet(log, time_ns, item, framer)
            continue
        _add_record(log, time_ns, item)
        done += 1
        if done % _TOLD_EACH == 0:
            tell("records", done, scene.records)
    tell("records", scene.records, scene.records)


def _add_record(log: _Log, time_ns: int, record: LogRecord) -> None:
    log.copy(record, time_ns)
    values = record.values
    if record.topic == "control":
        _add_control(log, time_ns, values)
    elif record.topic == "event":
        severity, text = values.get("severity", ""), values.get("text", "")
        log.add(MESSAGES, time_ns, messages.told(time_ns, severity, text))


def _add_control(log: _Log, time_ns: int, values: dict[str, Any]) -> None:
    position, attitude = point_of(values["position_enu_m"]), values["attitude_flu_to_enu"]
    if position is not None and None not in attitude:
        log.add(TRANSFORM, time_ns, messages.transform(time_ns, position, attitude))
        log.add(POSE, time_ns, messages.pose(time_ns, position, attitude))
    desired = point_of(values["desired_enu_m"])
    if desired is not None:
        log.add(DESIRED, time_ns, messages.pose(time_ns, desired, None))
    figures = messages.tracking(values)
    if figures is not None:
        log.add(TRACKING, time_ns, figures)


def _add_packet(log: _Log, time_ns: int, record: TlogRecord, framer: Framer) -> None:
    """Truth, location and texts; the other packets are for the tools that read tlogs."""
    if record.sent:
        return
    if is_truth_packet(record.raw):
        for frame in framer.feed(record.raw):
            if frame.message_id == MessageId.ODOMETRY:
                state = state_from_odometry(frame)
                if not isinstance(state, Rejected):
                    at = messages.pose(time_ns, state.position_enu_m, state.attitude_flu_to_enu)
                    log.add(TRUE_POSE, time_ns, at)
        return
    packet = taken_apart(record.raw)
    if packet.message_id == _GLOBAL_POSITION_INT:
        row = read_messages(packet.message_id, [packet.payload])[0]
        place = int(row["lat"]) * 1e-7, int(row["lon"]) * 1e-7, int(row["alt"]) * 1e-3
        log.add(LOCATION, time_ns, messages.location(time_ns, *place))
    elif packet.message_id == _STATUSTEXT:
        row = read_messages(packet.message_id, [packet.payload])[0]
        text = bytes(row["text"]).split(b"\0")[0].decode("utf-8", "replace")
        told = messages.told_by_autopilot(time_ns, int(row["severity"]), text)
        log.add(MESSAGES, time_ns, told)
