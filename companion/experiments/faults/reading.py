"""Evidence from a flight's folder: one pass over the packets, one over the records."""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from companion.experiments.faults.evidence import (
    Array,
    Begun,
    Evidence,
    Said,
    Sent,
    Tracked,
    TruePath,
)
from companion.experiments.faults.wire_log import WireLog, read_wire
from companion.mavlink.dialects.base import AutopilotDialect
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME
from companion.recording.mcap_log import read_records
from companion.recording.tlog import read_tlog

_PHASE = "phase "
_ENGAGED = "engage"
_TRACKED = "track"
_LONGEST_DELAY_S = 1.0
_TOLD_WITHIN_S = 5.0
_CLOCK_JUMPS_S = 0.5


@dataclass(slots=True)
class _Records:
    """What the controller and the voice have recorded."""

    said: list[Said] = field(default_factory=list)
    phases: list[tuple[float, str]] = field(default_factory=list)
    times_s: list[float] = field(default_factory=list)
    stamps_s: list[float] = field(default_factory=list)
    desired_enu_m: list[Sequence[float]] = field(default_factory=list)
    scored: list[bool] = field(default_factory=list)


def read_evidence(
    folder: Path,
    dialect: AutopilotDialect,
    base_us: int,
    *,
    outcome: str,
    completed: bool,
    note: str,
    ended_s: float,
) -> Evidence:
    """Read what a flight has left.

    Args:
        folder: with its tlog and its MCAP file.
        dialect: the autopilot's.
        base_us: microseconds since 1970 at time 0 of the companion's clock.
        outcome: the companion's word for how the flight ended.
        completed: the trajectory was flown to its end.
        note: why not, for a person.
        ended_s: when the companion's flight was over, by its clock.

    Raises:
        OSError: a file cannot be read.
        ValueError: it is none of a flight.
    """
    records = _read_records(folder / MCAP_NAME)
    engaged_s = next((time for time, name in records.phases if name == _ENGAGED), None)
    packets = (
        ((record.time_us - base_us) * 1e-6, record.sent, record.raw)
        for record in read_tlog(folder / TLOG_NAME)
    )
    wire = read_wire(packets, dialect, engaged_s)
    return Evidence(
        outcome=outcome,
        completed=completed,
        note=note,
        begun=_begun(wire),
        said=tuple(records.said),
        phases=tuple(records.phases),
        sent=_sent(wire),
        path=TruePath(
            np.array(wire.truth_times_s),
            np.array(wire.truth_positions_enu_m).reshape(-1, 3),
            np.array(wire.truth_velocities_enu_m_s).reshape(-1, 3),
            np.array(wire.truth_tilts_rad),
        ),
        tracked=_tracked(records, wire),
        taken_over_s=wire.taken_over_s,
        others_s=wire.others_s,
        commands=tuple(wire.commands),
        armed_s=wire.armed_s,
        disarmed_s=wire.disarmed_s,
        ended_s=ended_s,
    )


def _read_records(path: Path) -> _Records:
    found = _Records()
    for record in read_records(path):
        if record.topic == "event":
            _read_event(found, record.time_s, record.values)
        elif record.topic == "control":
            desired = record.values["desired_enu_m"]
            if desired is None or any(part is None for part in desired):
                continue
            found.times_s.append(record.values["received_s"])
            found.stamps_s.append(record.values["autopilot_time_s"])
            found.desired_enu_m.append(desired)
            found.scored.append(record.values["phase"] == _TRACKED)
    return found


def _read_event(found: _Records, time_s: float, values: Mapping[str, Any]) -> None:
    text = str(values["text"])
    if text.startswith(_PHASE):
        name, _, _ = text.removeprefix(_PHASE).partition(":")
        found.phases.append((time_s, name))
        if name != "handed over":
            return
        found.said.append(Said(time_s, "warning", text))
        return
    found.said.append(Said(time_s, str(values["severity"]), text))


def _sent(wire: WireLog) -> Sent:
    setpoints = wire.setpoints
    return Sent(
        time_s=np.array([s.time_s for s in setpoints]),
        finite=np.array([s.finite for s in setpoints], dtype=bool),
        tilt_rad=np.array([s.tilt_rad for s in setpoints]),
        thrust=np.array([s.thrust for s in setpoints]),
        rate_rad_s=np.array([s.rate_rad_s for s in setpoints]),
        state_age_s=np.array([s.state_age_s for s in setpoints]),
    )


def _begun(wire: WireLog) -> tuple[Begun, ...]:
    """Each event at the time of the last sample of the truth before it.

    It is told later, again and again, with the stamp of the moment at which it happened.  After
    the autopilot's clock has jumped, or begun anew, that is of the new clock.
    """
    found = [
        Begun(
            _moment_s(wire.truth_times_s, wire.truth_stamps_s, arrival_s, event.time_s),
            event.name,
            event.value,
        )
        for arrival_s, event in wire.events
    ]
    return tuple(sorted(found, key=lambda begun: (begun.time_s, begun.name, begun.value)))


def _moment_s(
    times_s: Sequence[float], stamps_s: Sequence[float], arrival_s: float, stamp_s: float
) -> float:
    """When something with a stamp happened, by the companion's clock.

    Args:
        times_s: when samples of the truth arrived.
        stamps_s: the autopilot's time in them.
        arrival_s: when it was first told.
        stamp_s: the autopilot's time that it was told with.
    """
    for index in range(bisect_right(times_s, arrival_s) - 1, -1, -1):
        if times_s[index] < arrival_s - _TOLD_WITHIN_S:
            break
        if stamps_s[index] <= stamp_s:
            return times_s[index]
        if index and not 0.0 <= stamps_s[index] - stamps_s[index - 1] < _CLOCK_JUMPS_S:
            return times_s[index - 1]
    return arrival_s


def _tracked(records: _Records, wire: WireLog) -> Tracked:
    """Each tick's reference against the truth at the moment of the tick's sample."""
    times = np.array(records.times_s)
    if not len(times) or not wire.truth_times_s:
        return Tracked(np.empty(0), np.empty(0), np.empty(0, dtype=bool))
    truth_times = np.array(wire.truth_times_s)
    at = _sample_times_s(times, np.array(records.stamps_s), truth_times, wire.truth_stamps_s)
    positions = np.array(wire.truth_positions_enu_m)
    true = np.stack([np.interp(at, truth_times, positions[:, k]) for k in range(3)], axis=1)
    error = np.linalg.norm(true - np.array(records.desired_enu_m), axis=1)
    return Tracked(times, error, np.array(records.scored, dtype=bool))


def _sample_times_s(
    received_s: Array, stamps_s: Array, truth_times_s: Array, truth_stamps: Sequence[float]
) -> Array:
    """When samples were true, by the companion's clock.

    Args:
        received_s: when they arrived.
        stamps_s: the autopilot's time in them.
        truth_times_s: when samples of the truth arrived, which nothing delays.
        truth_stamps: the autopilot's time in those.
    """
    newest = np.clip(np.searchsorted(truth_times_s, received_s, side="right") - 1, 0, None)
    age_s = np.array(truth_stamps)[newest] - stamps_s + (received_s - truth_times_s[newest])
    believable = (age_s >= -0.1) & (age_s <= _LONGEST_DELAY_S) & np.isfinite(age_s)
    at: Array = received_s - np.where(believable, np.maximum(age_s, 0.0), 0.0)
    return at
