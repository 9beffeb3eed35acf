"""A flight's log as the replay needs it: what the control loop was told, and what left."""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from pydantic import ValidationError

from companion.config.resolve import FlightConfig
from companion.flight.configuration_record import recorded_configuration
from companion.flight.records import CONFIGURATION, CONTROL, INPUT
from companion.flight.setpoints.inputs import HOLD, START
from companion.mavlink.framing import Frame, Framer
from companion.mavlink.messages import COMPONENT_ONBOARD_COMPUTER, MessageId
from companion.recording.flight_log import MCAP_NAME, RECOVERED, TLOG_NAME, recovered_first
from companion.recording.mcap_log import LogRecord, read_records
from companion.recording.tlog import TlogRecord, read_tlog

_SETPOINT = struct.Struct("<I8fBBB")
"""https://mavlink.io/en/messages/common.html#SET_ATTITUDE_TARGET as it lies on the wire."""
_SILENCE = "silence"


class ReplayError(Exception):
    """A log cannot be replayed; the text says which, why, and what to do, in one paragraph."""


@dataclass(frozen=True, slots=True)
class SentSetpoint:
    """A SET_ATTITUDE_TARGET that left."""

    time_s: float
    """Of the tlog, s since 1970."""
    payload: bytes
    """Whole: 39 bytes."""

    @property
    def target(self) -> tuple[int, int]:
        """System and component that it was sent to."""
        fields = _SETPOINT.unpack(self.payload)
        return int(fields[9]), int(fields[10])


@dataclass(frozen=True, slots=True)
class Told:
    """What the control loop was told besides samples (see `companion.flight.setpoints.inputs`)."""

    kind: str
    values: Mapping[str, Any]
    sent: tuple[SentSetpoint, ...] = ()
    """Of a hold: what left until its end."""


@dataclass(frozen=True, slots=True)
class Ticked:
    """A step of the control loop."""

    time_s: float
    """Of the autopilot's clock; estimated in silence."""
    loop_delay_s: float
    phase: str
    state_age_s: float
    unusable: str
    sent: SentSetpoint | None
    """None if none left, or it is not in the tlog."""

    @property
    def in_silence(self) -> bool:
        """There was no sample to fly on."""
        return self.phase == _SILENCE


@dataclass(frozen=True, slots=True)
class RecordedFlight:
    """All of a flight's log that its setpoints follow from, and they themselves."""

    config: FlightConfig
    trajectory_text: str
    """Of the trajectory's file; empty for one of the test trajectories."""
    made_by: Mapping[str, str]
    steps: tuple[Told | Ticked, ...]
    """In their order."""
    received: tuple[Frame, ...]
    """What came in."""
    missing: int
    """Setpoints that left by the records and are not in the tlog."""


def read_flight(folder: Path) -> RecordedFlight:
    """Read a flight's folder, be it finished or cut off.

    Args:
        folder: with `flight.mcap` and `flight.tlog`, or what was recovered of them, which goes
            first; or the path of one of its files, which is read whatever else there is.

    Raises:
        ReplayError: there is no such flight, it is damaged, or it cannot be replayed.
    """
    mcap, tlog = _files(folder)
    records = _records(mcap)
    packets = _packets(tlog)
    sent = [s for packet in packets if packet.sent for s in _setpoints(packet)]
    try:
        config, text, made_by = _configuration(mcap, records)
        steps, missing = _steps(records, sent)
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        raise ReplayError(
            f"{mcap}: its records are not those of a flight of this version "
            f"({type(error).__name__}: {error}). Replay it with the version that flew it."
        ) from error
    framer = Framer()
    received = [f for packet in packets if not packet.sent for f in framer.feed(packet.raw)]
    return RecordedFlight(config, text, made_by, steps, tuple(received), missing)


def _files(path: Path) -> tuple[Path, Path]:
    """The records and the packets of a flight, by its folder or by one of them."""
    if path.suffix == ".mcap":
        return path, _beside(path, TLOG_NAME)
    if path.suffix == ".tlog":
        return _beside(path, MCAP_NAME), path
    return recovered_first(path / MCAP_NAME), recovered_first(path / TLOG_NAME)


def _beside(named: Path, other: str) -> Path:
    """The other file of a flight: of the same stem; else, of what was recovered, the original."""
    same = named.with_suffix(Path(other).suffix)
    if same.exists():
        return same
    original = same.with_name(same.name.replace(RECOVERED, "", 1))
    return original if original.exists() else named.with_name(other)


def _records(path: Path) -> list[LogRecord]:
    topics = (CONFIGURATION.topic, CONTROL.topic, INPUT.topic)
    try:
        return [record for record in read_records(path) if record.topic in topics]
    except OSError as error:
        raise ReplayError(
            f"{path}: cannot be read ({error.strerror or error}). Give the folder of a flight."
        ) from error
    except (McapError, ValueError) as error:
        raise ReplayError(
            f"{path}: is damaged ({error}). `companion recover` saves what there is."
        ) from error


def _packets(path: Path) -> list[TlogRecord]:
    try:
        return list(read_tlog(path))
    except OSError as error:
        raise ReplayError(
            f"{path}: cannot be read ({error.strerror or error}). The replay needs both files."
        ) from error
    except ValueError as error:
        raise ReplayError(f"{error}. `companion recover` saves what there is.") from error


def _configuration(
    path: Path, records: list[LogRecord]
) -> tuple[FlightConfig, str, Mapping[str, str]]:
    found = [r.values for r in records if r.topic == CONFIGURATION.topic]
    if not found:
        raise ReplayError(
            f"{path}: does not say what was flown: it was recorded before flights could be "
            "replayed, or cut off at once. Fly it again."
        )
    values = found[0]
    if not values["replayable"]:
        raise ReplayError(
            f"{path}: is the flight of an experiment, or of a controller or trajectory that is in "
            "no file: its setpoints follow from more than the log holds. Replay an ordinary flight."
        )
    try:
        config = recorded_configuration(values)
    except (KeyError, ValidationError) as error:
        raise ReplayError(
            f"{path}: its configuration is not one of this version ({error}). Replay it with "
            f"version {values.get('made_by', {}).get('companion', 'unknown')}."
        ) from error
    return config, values["trajectory_file"], values["made_by"]


def _setpoints(packet: TlogRecord) -> Iterator[SentSetpoint]:
    """Those of the companion itself: clients' that were passed on are not its doing.

    It sends as the vehicle's onboard computer, an address that no client may have.
    """
    for frame in Framer().feed(packet.raw):
        if frame.message_id != MessageId.SET_ATTITUDE_TARGET:
            continue
        payload = frame.payload.ljust(_SETPOINT.size, b"\0")[: _SETPOINT.size]
        sent = SentSetpoint(packet.time_us * 1e-6, payload)
        if (frame.system_id, frame.component_id) == (sent.target[0], COMPONENT_ONBOARD_COMPUTER):
            yield sent


def _steps(
    records: list[LogRecord], sent: list[SentSetpoint]
) -> tuple[tuple[Told | Ticked, ...], int]:
    """The steps in order, each with what it sent, and how many of these are missing.

    Each tick that sent has the next setpoint of the tlog; those between a hold and the next
    start are the hold's.
    """
    records = [r for r in records if r.topic != CONFIGURATION.topic]
    starts_s = [r.time_s for r in records if r.topic == INPUT.topic and r.values["kind"] == START]
    base_s = _base_s(records, sent)
    steps: list[Told | Ticked] = []
    place, missing = 0, 0
    for record in records:
        values = record.values
        if record.topic == INPUT.topic:
            held: list[SentSetpoint] = []
            if values["kind"] == HOLD:
                until_s = min((s for s in starts_s if s > record.time_s), default=float("inf"))
                while place < len(sent) and sent[place].time_s - base_s < until_s - 1e-5:
                    held.append(sent[place])
                    place += 1
            steps.append(Told(values["kind"], values["values"], tuple(held)))
            continue
        setpoint = None
        if values["sent"]:
            if place < len(sent):
                setpoint = sent[place]
                place += 1
            else:
                missing += 1
        steps.append(
            Ticked(
                values["autopilot_time_s"],
                values["loop_delay_s"] or 0.0,
                values["phase"],
                values["state_age_s"],
                values["unusable"],
                setpoint,
            )
        )
    return tuple(steps), missing + len(sent) - place


def _base_s(records: list[LogRecord], sent: list[SentSetpoint]) -> float:
    """Time of the tlog at the records' time 0: the first setpoint is in both."""
    for record in records:
        if record.topic == CONTROL.topic and record.values["sent"] and sent:
            return sent[0].time_s - record.time_s - (record.values["latency_s"] or 0.0)
    return 0.0
