"""What a page draws of a flight: few points, about the fault."""

import math
from dataclasses import dataclass

import numpy as np

from companion.experiments.faults.evidence import Array, Evidence
from companion.experiments.faults.table import Promise

_BEFORE_S = 3.0
_AFTER_S = 12.0
_POINTS = 240
_AIRBORNE_M = 0.1

Line = tuple[tuple[float, float], ...]
"""Points: time since the fault (or since the flight's begin) in seconds, value."""


@dataclass(frozen=True, slots=True)
class Curves:
    """Lines and moments of one flight."""

    begins_s: float
    ends_s: float
    error_mm: tuple[Line, ...]
    """True distance to the reference; a gap where there was none."""
    commanded_deg: tuple[Line, ...]
    """Tilt of the setpoints; a gap where none left."""
    true_deg: Line
    height_m: Line
    phases: tuple[tuple[float, str], ...]
    fault_s: float | None
    """0 if its beginning is known."""
    seen_s: float | None
    over_s: float | None
    """When the companion's flight was over."""


def make_curves(promise: Promise, evidence: Evidence, seen_after_s: float = math.nan) -> Curves:
    """Take from a flight what is drawn of it.

    Args:
        promise: of its row: names the event at which the fault begins.
        evidence: the flight.
        seen_after_s: when the fault was seen, since it began.
    """
    path = evidence.path
    if not len(path.time_s):
        return Curves(0.0, 1.0, (), (), (), (), (), None, None, None)
    times = [begun.time_s for begun in evidence.begun if begun.name == promise.begins]
    fault_s = min(times) if times else None
    first_s, last_s = float(path.time_s[0]), float(path.time_s[-1])
    if fault_s is None:
        up = np.flatnonzero(path.position_enu_m[:, 2] - path.position_enu_m[0, 2] > _AIRBORNE_M)
        zero_s = begin_s = float(path.time_s[up[0]]) - 1.0 if len(up) else first_s
        end_s = last_s
    else:
        zero_s, begin_s, end_s = fault_s, fault_s - _BEFORE_S, fault_s + _AFTER_S
    begin_s, end_s = max(begin_s, first_s), min(end_s, last_s)
    if end_s <= begin_s:
        end_s = begin_s + 1.0
    step_s = (end_s - begin_s) / _POINTS

    def line(times_s: Array, values: Array) -> tuple[Line, ...]:
        return _line(times_s, values, zero_s, (begin_s, end_s), step_s)

    def moment(time_s: float) -> float | None:
        return time_s - zero_s if begin_s <= time_s <= end_s else None

    sent = evidence.sent
    height = path.position_enu_m[:, 2] - path.position_enu_m[0, 2]
    true = line(path.time_s, np.degrees(path.tilt_rad))
    heights = line(path.time_s, height)
    return Curves(
        begins_s=begin_s - zero_s,
        ends_s=end_s - zero_s,
        error_mm=line(evidence.tracked.time_s, evidence.tracked.error_m * 1e3),
        commanded_deg=line(sent.time_s, np.degrees(sent.tilt_rad)),
        true_deg=true[0] if true else (),
        height_m=heights[0] if heights else (),
        phases=tuple(
            (max(time, begin_s) - zero_s, name)
            for (time, name), (until, _) in zip(
                evidence.phases, [*evidence.phases[1:], (math.inf, "")], strict=True
            )
            if time <= end_s and until > begin_s
        ),
        fault_s=None if fault_s is None else 0.0,
        seen_s=None if math.isnan(seen_after_s) else moment(zero_s + seen_after_s),
        over_s=moment(evidence.ended_s),
    )


def _line(
    times_s: Array,
    values: Array,
    zero_s: float,
    interval_s: tuple[float, float],
    step_s: float,
) -> tuple[Line, ...]:
    """The largest value of each step, in pieces without a gap.

    Args:
        times_s: (n,) in rising order.
        values: (n,).
        zero_s: where the line's time begins.
        interval_s: what is wanted.
        step_s: of the line's points.
    """
    inside = (times_s >= interval_s[0]) & (times_s <= interval_s[1]) & np.isfinite(values)
    pieces: list[list[tuple[float, float]]] = []
    last_s = -math.inf
    for time, value in zip(times_s[inside].tolist(), values[inside].tolist(), strict=True):
        if time - last_s > max(0.25, 2.0 * step_s):
            pieces.append([])
        last_s = time
        at = zero_s + math.floor((time - zero_s) / step_s) * step_s
        point = (round(at - zero_s, 3), round(value, 4))
        if pieces[-1] and pieces[-1][-1][0] == point[0]:
            pieces[-1][-1] = max(pieces[-1][-1], point)
        else:
            pieces[-1].append(point)
    return tuple(tuple(piece) for piece in pieces)
