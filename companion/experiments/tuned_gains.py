"""Which gains of each framework are tuned, over what ranges, and from where.

A search point has one coordinate from 0 to 1 for each tuned gain.  Gains are searched by their
logarithm; one that may be zero by a shifted logarithm, that of gain + knee, and is zero over the
first part of its range: a search comes near the edge of its range and never quite onto it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Gains = dict[str, tuple[float, float, float]]
"""Per axis (x, y, z), by dotted key of a controller's file (``outer_pid.kp``)."""

_DIGITS = 4
_ZERO_UP_TO = 0.05
"""Coordinate up to which a gain that may be zero is zero."""


@dataclass(frozen=True, slots=True)
class TunedGain:
    """One coordinate of the search: a gain, the same on all of its axes."""

    key: str
    axes: tuple[int, ...]
    low: float
    """Least value; for a gain that may be zero the knee of the shifted logarithm."""
    high: float
    starts: tuple[float, float]
    """A gentle and an aggressive value."""
    from_zero: bool = True

    def value(self, coordinate: float) -> float:
        """The gain at a coordinate, rounded as it is written and flown."""
        ratio = self.high / self.low
        if self.from_zero:
            share = max(0.0, coordinate - _ZERO_UP_TO) / (1.0 - _ZERO_UP_TO)
            value = self.low * ((1.0 + ratio) ** share - 1.0)
        else:
            value = self.low * ratio**coordinate
        return float(f"{value:.{_DIGITS}g}")

    def coordinate(self, value: float) -> float:
        """The coordinate of a gain."""
        ratio = self.high / self.low
        if self.from_zero:
            share = math.log1p(value / self.low) / math.log1p(ratio)
            return _ZERO_UP_TO + (1.0 - _ZERO_UP_TO) * share
        return math.log(max(value, self.low) / self.low) / math.log(ratio)


_XY, _Z = (0, 1), (2,)

TUNED: dict[str, tuple[TunedGain, ...]] = {
    "pid-l1": (
        TunedGain("outer_pid.kp", _XY, 0.05, 100.0, (0.5, 8.0)),
        TunedGain("outer_pid.ki", _XY, 0.02, 20.0, (0.05, 1.0)),
        TunedGain("outer_pid.kd", _XY, 0.02, 60.0, (0.1, 4.0)),
        TunedGain("outer_pid.kp", _Z, 0.05, 10.0, (0.3, 2.0)),
        TunedGain("outer_pid.ki", _Z, 0.02, 5.0, (0.05, 0.5)),
        TunedGain("outer_pid.kd", _Z, 0.02, 5.0, (0.0, 0.3)),
    ),
    # The weight on r2 - y2* is left at 1: only the ratios of the weights matter.
    "lqr-l1": (
        TunedGain("lqr.position", _XY, 0.001, 1e5, (1.0, 50.0), from_zero=False),
        TunedGain("lqr.velocity", _XY, 0.01, 1000.0, (0.1, 5.0)),
        TunedGain("lqr.integral", _XY, 0.001, 1e6, (0.05, 100.0), from_zero=False),
        TunedGain("lqr.position", _Z, 0.01, 1000.0, (1.0, 20.0), from_zero=False),
        TunedGain("lqr.velocity", _Z, 0.01, 100.0, (0.1, 1.0)),
        TunedGain("lqr.integral", _Z, 0.001, 1000.0, (0.05, 5.0), from_zero=False),
    ),
    # u is the sine of the tilt on x and y, and a climb rate in m/s on z.
    "pid": (
        TunedGain("inner_pid.kp", _XY, 0.02, 3.0, (0.2, 0.6), from_zero=False),
        TunedGain("inner_pid.ki", _XY, 0.01, 2.0, (0.02, 0.2)),
        TunedGain("inner_pid.kd", _XY, 0.02, 2.0, (0.2, 0.35)),
        TunedGain("inner_pid.kp", _Z, 0.1, 10.0, (0.8, 2.5), from_zero=False),
        TunedGain("inner_pid.ki", _Z, 0.05, 5.0, (0.05, 0.5)),
        TunedGain("inner_pid.kd", _Z, 0.02, 2.0, (0.0, 0.1)),
    ),
}
"""By framework."""

_MODEL = (
    TunedGain("mpc_model.m", _XY, 0.1, 30.0, (2.0, 5.0), from_zero=False),
    TunedGain("mpc_model.k", _XY, 0.1, 100.0, (0.8, 1.5), from_zero=False),
    TunedGain("mpc_model.m", _Z, 0.1, 30.0, (3.0, 6.0), from_zero=False),
    TunedGain("mpc_model.k", _Z, 0.1, 100.0, (0.8, 2.0), from_zero=False),
)

TUNED_BELOW_MPC: dict[str, tuple[TunedGain, ...]] = {
    "model": _MODEL,
    "whole": (*TUNED["pid"], *_MODEL),
}
"""Of mpc-pid, flown with its MPC: its model alone, or the PID and the model together."""


def gains_at(table: Sequence[TunedGain], point: Sequence[float] | Array) -> Gains:
    """The gains at a point of the search."""
    gains: dict[str, list[float]] = {tuned.key: [math.nan] * 3 for tuned in table}
    for tuned, coordinate in zip(table, point, strict=True):
        for axis in tuned.axes:
            gains[tuned.key][axis] = tuned.value(min(1.0, max(0.0, float(coordinate))))
    return {key: (values[0], values[1], values[2]) for key, values in gains.items()}


def starting_points(
    table: Sequence[TunedGain], count: int, random: np.random.Generator
) -> list[tuple[str, Array]]:
    """Points to start from, with names: the table's gentle and aggressive ones, then random."""
    named = [
        (name, np.array([tuned.coordinate(tuned.starts[k]) for tuned in table]))
        for k, name in enumerate(("gentle", "aggressive"))
    ]
    drawn = [(f"random {k + 1}", random.uniform(0.1, 0.9, len(table))) for k in range(count - 2)]
    return (named + drawn)[:count]


def point_of(table: Sequence[TunedGain], data: Mapping[str, Any]) -> Array:
    """The point of the search at which a controller's file stands, cut to the ranges."""
    point = []
    for tuned in table:
        section, _, name = tuned.key.partition(".")
        point.append(tuned.coordinate(float(data[section][name][tuned.axes[0]])))
    clipped: Array = np.clip(np.array(point), 0.0, 1.0)
    return clipped


def as_settings(gains: Gains) -> tuple[tuple[str, str], ...]:
    """The gains as ``--set`` takes them."""
    return tuple((f"controller.{key}", str(list(values))) for key, values in gains.items())


def with_gains(data: Mapping[str, Any], gains: Gains) -> dict[str, Any]:
    """A controller's file with gains in place of its own."""
    changed = dict(data)
    for key, values in gains.items():
        section, _, name = key.partition(".")
        changed[section] = {**(changed.get(section) or {}), name: list(values)}
    return changed
