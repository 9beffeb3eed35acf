"""How far the setpoints of a replay are from those that left in flight, in figures."""

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from companion.control.reference_model import Array
from companion.flight.replay.replay import Replay, ReplayedSetpoint
from companion.frames import attitude_from_wire

_FIELDS = struct.Struct("<I8fBBB")
_BODY_RATES = 128
"""The type mask of setpoints of body rates."""


@dataclass(frozen=True, slots=True)
class SetpointSeries:
    """Setpoints over time, as arrays of one length; NaN where there is none."""

    time_s: Array
    """Of the autopilot's clock."""
    tilt_east_deg: Array
    """Of the commanded thrust's direction, from the vertical towards east; of rates: FLU x."""
    tilt_north_deg: Array
    """Towards north; of rates: FLU y."""
    thrust: Array


@dataclass(frozen=True, slots=True)
class Apart:
    """Differences between two series."""

    tilt_rms_deg: float
    tilt_max_deg: float
    thrust_rms: float
    thrust_max: float


@dataclass(frozen=True, slots=True)
class ReplayFigures:
    """A replay in figures."""

    recorded: SetpointSeries
    replayed: SetpointSeries
    apart: Apart
    compared: int
    identical: int
    unmatched: int
    rates: bool
    """Setpoints of body rates: "tilt" then stands for rates in degrees per second."""

    def record(self) -> Mapping[str, Any]:
        """As `replay.json` has it."""
        return {
            "setpoints": self.compared,
            "identical": self.identical,
            "unmatched": self.unmatched,
            "rate_rms_deg_s" if self.rates else "tilt_rms_deg": _number(self.apart.tilt_rms_deg),
            "rate_max_deg_s" if self.rates else "tilt_max_deg": _number(self.apart.tilt_max_deg),
            "thrust_rms": _number(self.apart.thrust_rms),
            "thrust_max": _number(self.apart.thrust_max),
        }


def replay_figures(replay: Replay) -> ReplayFigures:
    """Figures of a replay."""
    rates = any(_FIELDS.unpack(s.recorded)[11] == _BODY_RATES for s in replay.setpoints)
    recorded = _series(replay.setpoints, [s.recorded for s in replay.setpoints])
    replayed = _series(replay.setpoints, [s.replayed for s in replay.setpoints])
    tilt = np.hypot(
        recorded.tilt_east_deg - replayed.tilt_east_deg,
        recorded.tilt_north_deg - replayed.tilt_north_deg,
    )
    thrust = np.abs(recorded.thrust - replayed.thrust)
    return ReplayFigures(
        recorded,
        replayed,
        Apart(_rms(tilt), _largest(tilt), _rms(thrust), _largest(thrust)),
        len(replay.setpoints),
        sum(s.identical for s in replay.setpoints),
        replay.unmatched,
        rates,
    )


def _series(
    setpoints: tuple[ReplayedSetpoint, ...], payloads: list[bytes | None]
) -> SetpointSeries:
    rows = [_row(payload) for payload in payloads]
    east, north, thrust = np.array(rows, dtype=float).reshape(-1, 3).T
    return SetpointSeries(np.array([s.time_s for s in setpoints]), east, north, thrust)


def _row(payload: bytes | None) -> tuple[float, float, float]:
    if payload is None:
        return math.nan, math.nan, math.nan
    _, qw, qx, qy, qz, p, q, _, thrust, _, _, mask = _FIELDS.unpack(payload)
    if mask == _BODY_RATES:
        return math.degrees(p), -math.degrees(q), thrust
    w, x, y, z = attitude_from_wire((qw, qx, qy, qz))
    up = 1.0 - 2.0 * (x * x + y * y)
    east = math.degrees(math.atan2(2.0 * (x * z + w * y), up))
    north = math.degrees(math.atan2(2.0 * (y * z - w * x), up))
    return east, north, thrust


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else math.nan


def _largest(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.max()) if len(known) else math.nan


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
