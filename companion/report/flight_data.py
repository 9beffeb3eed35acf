"""A flight as arrays: from its folder, or from records and packets that were kept in memory."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.mavlink.framing import Framer
from companion.mavlink.messages import COMPONENT_TRUTH, MessageId
from companion.mavlink.telemetry import Rejected, state_from_odometry, wind_acceleration
from companion.mavlink.truth_events import TruthEvent, truth_event
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME, recovered_first
from companion.recording.mcap_log import LogRecord, read_records
from companion.recording.tlog import read_tlog

Array = NDArray[np.float64]

_MAVLINK_2 = 0xFD
_COMPONENT_OFFSET = 6
"""Place of the component id in a MAVLink 2 packet."""
_GAUGES = ("y_tilde_gauge", "sigma_gauge", "slew_gauge", "delay_gauge")
_MCAP_BEGINNING_BYTES = 8
"""A file with less has not even its magic bytes: a full disk, or the end just after opening it."""


@dataclass(frozen=True, slots=True)
class Watched:
    """What the in-flight monitor said, one row a tick."""

    controller: NDArray[np.str_]
    """That flew the tick; empty where none did."""
    gauges: Array
    """(n, 4): ỹ, σ̂, slew and delay, each over its bound; NaN where there is nothing to say."""


@dataclass(frozen=True, slots=True)
class Ticks:
    """The controller's records, one row a tick; times by the autopilot's clock."""

    time_s: Array
    position_enu_m: Array
    velocity_enu_m_s: Array
    desired_enu_m: Array
    r2_enu_m: Array
    r1_enu_m_s: Array
    u: Array
    applied_u: Array
    y_tilde_m_s: Array
    sigma_hat: Array
    projecting: NDArray[np.bool_]
    roll_rad: Array
    pitch_rad: Array
    thrust: Array
    hover_thrust: Array
    computed_us: Array
    plan: NDArray[np.str_]
    """Status of the outer controller's run at this tick; empty where it did not run."""
    r_max_active: NDArray[np.bool_]
    """The bound on the second difference of r was active in the plan made at this tick."""
    on_fallback: NDArray[np.bool_]
    """What was sent at this tick was a fallback's."""
    phase: NDArray[np.str_]
    """Phase of the flight."""
    watched: Watched | None = None
    """None for a log that says nothing of it."""


@dataclass(frozen=True, slots=True)
class Truth:
    """What a simulation says of itself; empty arrays in a real flight."""

    time_s: Array
    position_enu_m: Array
    velocity_enu_m_s: Array
    wind_time_s: Array
    wind_acceleration_m_s2: Array
    """Magnitude."""
    events: tuple[TruthEvent, ...] = ()
    """What the scenario did to the vehicle or its air, each once, by time."""


@dataclass(frozen=True, slots=True)
class FlightData:
    """A recorded flight."""

    ticks: Ticks
    truth: Truth


def read_flight(folder: Path) -> FlightData:
    """Read the logs in a flight's folder, finished or not; what was recovered goes first.

    Raises:
        OSError: a file cannot be read.
        ValueError: the packets' file is no tlog, or the records are not those of a flight.
        mcap.exceptions.McapError: the records' file is no MCAP file.
    """
    return flight_from_log(read_log(folder), folder)


def read_log(folder: Path) -> dict[str, list[LogRecord]]:
    """The controller's records in a flight's folder by topic, each in the order of writing.

    Raises:
        OSError: the file cannot be read.
        mcap.exceptions.McapError: it is no MCAP file.
    """
    path = recovered_first(folder / MCAP_NAME)
    found: dict[str, list[LogRecord]] = {}
    if path.stat().st_size >= _MCAP_BEGINNING_BYTES:
        for record in read_records(path):
            found.setdefault(record.topic, []).append(record)
    return found


def flight_from_log(log: Mapping[str, Sequence[LogRecord]], folder: Path) -> FlightData:
    """A flight of records that have been read, and of the packets in its folder.

    Raises:
        OSError: the packets cannot be read.
        ValueError: their file is no tlog, or the records are not those of a flight.
    """
    control, plans = ([record.values for record in log.get(t, ())] for t in ("control", "plan"))
    packets = (record.raw for record in read_tlog(recovered_first(folder / TLOG_NAME)))
    try:
        ticks = ticks_from_records(control, plans)
    except (KeyError, TypeError, OverflowError) as error:
        raise ValueError(
            f"{folder / MCAP_NAME}: its records are not those of a flight of this version "
            f"({type(error).__name__}: {error})"
        ) from error
    return FlightData(ticks, truth_from_packets(packets))


def ticks_from_records(
    control: Sequence[Mapping[str, Any]], plans: Iterable[Mapping[str, Any]]
) -> Ticks:
    """Arrays of the records of the channels `control` and `plan`; null and absent are NaN."""

    def numbers(key: str) -> Array:
        return np.array([_number(r[key]) for r in control], dtype=float)

    def vectors(key: str) -> Array:
        return np.array([_vector(r[key]) for r in control], dtype=float).reshape(-1, 3)

    def flags(key: str) -> NDArray[np.bool_]:
        return np.array([bool(r[key]) for r in control], dtype=bool)

    plan_at = {plan["autopilot_time_s"]: plan for plan in plans}
    made = [plan_at.get(r["autopilot_time_s"]) for r in control]
    return Ticks(
        time_s=numbers("autopilot_time_s"),
        position_enu_m=vectors("position_enu_m"),
        velocity_enu_m_s=vectors("velocity_enu_m_s"),
        desired_enu_m=vectors("desired_enu_m"),
        r2_enu_m=vectors("r2_enu_m"),
        r1_enu_m_s=vectors("r1_enu_m_s"),
        u=vectors("u"),
        applied_u=vectors("applied_u"),
        y_tilde_m_s=vectors("y_tilde_m_s"),
        sigma_hat=vectors("sigma_hat"),
        projecting=flags("projecting"),
        roll_rad=numbers("roll_rad"),
        pitch_rad=numbers("pitch_rad"),
        thrust=numbers("thrust"),
        hover_thrust=numbers("hover_thrust"),
        computed_us=numbers("computed_us"),
        plan=np.array(["" if plan is None else plan["status"] for plan in made], dtype=str),
        r_max_active=np.array(
            [plan is not None and bool(plan["r_max_active"]) for plan in made], dtype=bool
        ),
        on_fallback=flags("fallback"),
        phase=np.array([r["phase"] for r in control], dtype=str),
        watched=_watched(control),
    )


def _watched(control: Sequence[Mapping[str, Any]]) -> Watched | None:
    if not control or "slew_gauge" not in control[0]:
        return None
    gauges = [[_number(r[key]) for key in _GAUGES] for r in control]
    return Watched(np.array([r["controller"] for r in control], dtype=str), np.array(gauges))


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _vector(value: Sequence[float | None] | None) -> list[float]:
    return [math.nan] * 3 if value is None else [_number(v) for v in value]


def is_truth_packet(raw: bytes) -> bool:
    """True for a packet of the simulation's truth; a look at two bytes."""
    return raw[0] == _MAVLINK_2 and raw[_COMPONENT_OFFSET] == COMPONENT_TRUTH


def truth_from_packets(packets: Iterable[bytes]) -> Truth:
    """The truth among a flight's packets, each of them whole, in the order of arrival."""
    framer = Framer()
    times: list[float] = []
    positions: list[tuple[float, float, float]] = []
    velocities: list[tuple[float, float, float]] = []
    wind_times: list[float] = []
    winds: list[float] = []
    events: set[TruthEvent] = set()
    for raw in packets:
        if not is_truth_packet(raw):
            continue  # most packets: looked at before they are framed, which costs more
        for frame in framer.feed(raw):
            if frame.message_id == MessageId.ODOMETRY:
                state = state_from_odometry(frame)
                if not isinstance(state, Rejected):
                    times.append(state.time_s)
                    positions.append(state.position_enu_m)
                    velocities.append(state.velocity_enu_m_s)
            elif frame.message_id == MessageId.DEBUG_VECT:
                wind = wind_acceleration(frame)
                if wind is not None and not isinstance(wind, Rejected):
                    wind_times.append(wind.time_s)
                    winds.append(math.sqrt(sum(c * c for c in wind.acceleration_enu_m_s2)))
            elif frame.message_id == MessageId.NAMED_VALUE_FLOAT:
                event = truth_event(frame)
                if not isinstance(event, Rejected):
                    events.add(event)
    return Truth(
        np.array(times),
        np.array(positions).reshape(-1, 3),
        np.array(velocities).reshape(-1, 3),
        np.array(wind_times),
        np.array(winds),
        tuple(sorted(events, key=lambda event: (event.time_s, event.name))),
    )
