"""A flight as its page tells it: arrays, messages, phases, and what each tick says of itself."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.recording.mcap_log import LogRecord
from companion.report.flight_data import Array, FlightData, flight_from_log, read_log

_PHASE = "phase "


@dataclass(frozen=True, slots=True)
class Message:
    """What a person was told."""

    time_s: float
    """By the log's clock."""
    severity: str
    text: str


@dataclass(frozen=True, slots=True)
class Phase:
    """A part of the flight."""

    name: str
    detail: str
    begin_s: float
    """By the log's clock."""
    end_s: float


@dataclass(frozen=True, slots=True)
class Said:
    """What each tick says beside the arrays of `Ticks`, one row for each of them."""

    log_time_s: Array
    latency_s: Array
    """From the sample's arrival to its setpoint's departure; 0 in simulated time."""
    loop_delay_s: Array
    state_age_s: Array
    fallback: NDArray[np.str_]
    reason: NDArray[np.str_]
    monitor: NDArray[np.str_]
    y_tilde_bound_m_s: Array
    sigma_bound: Array


@dataclass(frozen=True, slots=True)
class Story:
    """A recorded flight."""

    data: FlightData
    said: Said
    messages: tuple[Message, ...]
    phases: tuple[Phase, ...]
    made_by: Mapping[str, Any]
    """Versions and machine; empty for a log that does not say."""
    autopilot_ahead_s: float
    """The autopilot's clock minus the log's; 0 where no state was flown on."""


def read_story(folder: Path) -> Story:
    """Read the logs in a flight's folder.

    Raises:
        OSError: a file cannot be read.
        ValueError: the packets' file is no tlog, or the records are not those of a flight.
        mcap.exceptions.McapError: the records' file is no MCAP file.
    """
    log = read_log(folder)
    return story_of(flight_from_log(log, folder), log)


def story_of(data: FlightData, log: Mapping[str, Sequence[LogRecord]]) -> Story:
    """The story of records that have been read.

    Args:
        data: made of them.
        log: records by topic.
    """
    control = log.get("control", ())
    said = _said(control)
    messages, phases = _messages(log.get("event", ())), _phases(log)
    ahead = data.ticks.time_s - said.log_time_s
    ahead = ahead[np.isfinite(ahead)]
    told = log.get("configuration", ())
    return Story(
        data,
        said,
        messages,
        phases,
        dict(told[0].values.get("made_by") or {}) if told else {},
        float(np.median(ahead)) if len(ahead) else 0.0,
    )


def _said(control: Sequence[LogRecord]) -> Said:
    def numbers(key: str) -> Array:
        return np.array([_number(r.values.get(key)) for r in control], dtype=float)

    def words(key: str) -> NDArray[np.str_]:
        return np.array([r.values.get(key) or "" for r in control], dtype=str)

    def vectors(key: str) -> Array:
        rows = [[_number(v) for v in r.values.get(key) or (None,) * 3] for r in control]
        return np.array(rows, dtype=float).reshape(-1, 3)

    return Said(
        log_time_s=np.array([r.time_s for r in control], dtype=float),
        latency_s=numbers("latency_s"),
        loop_delay_s=numbers("loop_delay_s"),
        state_age_s=numbers("state_age_s"),
        fallback=words("fallback"),
        reason=words("reason"),
        monitor=words("monitor"),
        y_tilde_bound_m_s=vectors("y_tilde_bound_m_s"),
        sigma_bound=vectors("sigma_bound"),
    )


def _messages(events: Sequence[LogRecord]) -> tuple[Message, ...]:
    """All that was told but the phases."""
    told = [
        Message(r.time_s, str(r.values.get("severity", "")), str(r.values.get("text", "")))
        for r in events
    ]
    return tuple(one for one in told if not one.text.startswith(_PHASE))


def _phases(log: Mapping[str, Sequence[LogRecord]]) -> tuple[Phase, ...]:
    begun = [
        (r.time_s, str(r.values["text"]).removeprefix(_PHASE))
        for r in log.get("event", ())
        if str(r.values.get("text", "")).startswith(_PHASE)
    ]
    if not begun:
        return ()
    last_s = max((records[-1].time_s for records in log.values() if records), default=0.0)
    ends = [*(time_s for time_s, _ in begun[1:]), last_s]
    found = []
    for (begin_s, text), end_s in zip(begun, ends, strict=True):
        name, _, detail = text.partition(": ")
        found.append(Phase(name, detail, begin_s, end_s))
    return tuple(found)


def _number(value: float | None) -> float:
    return math.nan if value is None else value
