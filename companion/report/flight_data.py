"""Reading a flight's folder back into arrays."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.mavlink.framing import Framer
from companion.mavlink.messages import COMPONENT_TRUTH, MessageId
from companion.mavlink.telemetry import Rejected, state_from_odometry, wind_acceleration
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME
from companion.recording.mcap_log import read_records
from companion.recording.tlog import read_tlog

Array = NDArray[np.float64]

_MAVLINK_2 = 0xFD
_COMPONENT_OFFSET = 6
"""Place of the component id in a MAVLink 2 packet."""
_MCAP_BEGINNING_BYTES = 8
"""A file with less has not even its magic bytes: a full disk, or the end just after opening it."""


@dataclass(frozen=True, slots=True)
class Ticks:
    """The controller's records, one row a tick; times by the autopilot's clock."""

    time_s: Array
    position_enu_m: Array
    desired_enu_m: Array
    r2_enu_m: Array
    y_tilde_m_s: Array
    sigma_hat: Array
    roll_rad: Array
    pitch_rad: Array
    thrust: Array
    hover_thrust: Array
    computed_us: Array
    plan: NDArray[np.str_]
    """Status of the outer controller's run at this tick; empty where it did not run."""
    on_fallback: NDArray[np.bool_]
    """What was sent at this tick was a fallback's."""
    phase: NDArray[np.str_]
    """Phase of the flight."""


@dataclass(frozen=True, slots=True)
class Truth:
    """What a simulation says of itself; empty arrays in a real flight."""

    time_s: Array
    position_enu_m: Array
    wind_time_s: Array
    wind_acceleration_m_s2: Array
    """Magnitude."""


@dataclass(frozen=True, slots=True)
class FlightData:
    """A recorded flight."""

    ticks: Ticks
    truth: Truth


def read_flight(folder: Path) -> FlightData:
    """Read the logs in a flight's folder, finished or not."""
    return FlightData(_read_ticks(folder / MCAP_NAME), _read_truth(folder / TLOG_NAME))


def _read_ticks(path: Path) -> Ticks:
    records: list[dict[str, Any]] = []
    plans: dict[float, str] = {}
    begun = path.stat().st_size >= _MCAP_BEGINNING_BYTES
    for record in read_records(path) if begun else ():
        if record.topic == "control":
            records.append(record.values)
        elif record.topic == "plan":
            plans[record.values["autopilot_time_s"]] = record.values["status"]

    def numbers(key: str) -> Array:
        return np.array([_number(r[key]) for r in records], dtype=float)

    def vectors(key: str) -> Array:
        return np.array([_vector(r[key]) for r in records], dtype=float).reshape(-1, 3)

    return Ticks(
        time_s=numbers("autopilot_time_s"),
        position_enu_m=vectors("position_enu_m"),
        desired_enu_m=vectors("desired_enu_m"),
        r2_enu_m=vectors("r2_enu_m"),
        y_tilde_m_s=vectors("y_tilde_m_s"),
        sigma_hat=vectors("sigma_hat"),
        roll_rad=numbers("roll_rad"),
        pitch_rad=numbers("pitch_rad"),
        thrust=numbers("thrust"),
        hover_thrust=numbers("hover_thrust"),
        computed_us=numbers("computed_us"),
        plan=np.array([plans.get(r["autopilot_time_s"], "") for r in records], dtype=str),
        on_fallback=np.array([bool(r["fallback"]) for r in records], dtype=bool),
        phase=np.array([r["phase"] for r in records], dtype=str),
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _vector(value: Sequence[float | None] | None) -> list[float]:
    return [math.nan] * 3 if value is None else [_number(v) for v in value]


def _read_truth(path: Path) -> Truth:
    framer = Framer()
    times: list[float] = []
    positions: list[tuple[float, float, float]] = []
    wind_times: list[float] = []
    winds: list[float] = []
    for record in read_tlog(path):
        if record.raw[0] != _MAVLINK_2 or record.raw[_COMPONENT_OFFSET] != COMPONENT_TRUTH:
            continue  # most packets: looked at before they are framed, which costs more
        for frame in framer.feed(record.raw):
            if frame.message_id == MessageId.ODOMETRY:
                state = state_from_odometry(frame)
                if not isinstance(state, Rejected):
                    times.append(state.time_s)
                    positions.append(state.position_enu_m)
            elif frame.message_id == MessageId.DEBUG_VECT:
                wind = wind_acceleration(frame)
                if wind is not None and not isinstance(wind, Rejected):
                    wind_times.append(wind.time_s)
                    winds.append(math.sqrt(sum(c * c for c in wind.acceleration_enu_m_s2)))
    return Truth(
        np.array(times),
        np.array(positions).reshape(-1, 3),
        np.array(wind_times),
        np.array(winds),
    )
