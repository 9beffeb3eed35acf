"""Figures of merit of a flight.

Tracking error is |y2* - y2|: the desired position minus the vehicle's, paired by the autopilot's
time.  It is taken against the simulation's truth where there is one, and against the position that
the autopilot reports in any case.
"""

from dataclasses import dataclass

import numpy as np

from companion.mavlink.truth_events import TruthEvent
from companion.report.flight_data import Array, FlightData

_LONGEST_STRAIGHT_S = 0.025
"""A straight line over this time is off by a_max t² / 8, 0.3 mm on the hardest trajectory."""


@dataclass(frozen=True, slots=True)
class ErrorFigures:
    """Of the distance between desired and actual position, m."""

    mean_m: float
    rms_m: float
    max_m: float


@dataclass(frozen=True, slots=True)
class TrackingFigures:
    """How well a flight tracked; None where there is nothing to say."""

    against_truth: ErrorFigures | None
    as_reported: ErrorFigures | None
    wind_peak_m_s2: float | None
    """Greatest acceleration by wind while tracking was scored; None without a simulation."""


def tracking_figures(data: FlightData, scored_s: tuple[float, float]) -> TrackingFigures:
    """Score a flight between two times of the autopilot's clock."""
    _, reported = reported_error(data, scored_s)
    _, true = true_error(data, scored_s)
    inside = _inside(data.truth.wind_time_s, scored_s)
    wind = data.truth.wind_acceleration_m_s2[inside]
    return TrackingFigures(
        against_truth=_figures(true),
        as_reported=_figures(reported),
        wind_peak_m_s2=float(wind.max()) if len(wind) else None,
    )


def reported_error(data: FlightData, interval_s: tuple[float, float]) -> tuple[Array, Array]:
    """Times and distances to the reference by the reported position."""
    times, error = reported_error_enu(data, interval_s)
    return times, _lengths(error)


def true_error(data: FlightData, interval_s: tuple[float, float]) -> tuple[Array, Array]:
    """Times and distances to the reference by the true position; empty without a truth."""
    times, error = true_error_enu(data, interval_s)
    return times, _lengths(error)


def reported_error_enu(data: FlightData, interval_s: tuple[float, float]) -> tuple[Array, Array]:
    """Times, and reported minus desired position (n, 3)."""
    ticks = data.ticks
    error: Array = ticks.position_enu_m - ticks.desired_enu_m
    use = _inside(ticks.time_s, interval_s) & np.isfinite(error).all(axis=1)
    return ticks.time_s[use], error[use]


def true_error_enu(data: FlightData, interval_s: tuple[float, float]) -> tuple[Array, Array]:
    """Times, and true minus desired position (n, 3); empty without a truth.

    Only between the first and the last tick that had a reference: before and after, there was
    nothing to be followed.
    """
    ticks, truth = data.ticks, data.truth
    known = np.isfinite(ticks.desired_enu_m).all(axis=1)
    if not known.any():
        return np.empty(0), np.empty((0, 3))
    known_times, first = np.unique(ticks.time_s[known], return_index=True)
    use = _inside(truth.time_s, interval_s) & _inside(
        truth.time_s, (known_times[0], known_times[-1])
    )
    if not use.any():
        return np.empty(0), np.empty((0, 3))
    times = truth.time_s[use]
    desired = _between(known_times, ticks.desired_enu_m[known][first], times)
    error: Array = truth.position_enu_m[use] - desired
    return times, error


def _lengths(vectors_m: Array) -> Array:
    lengths: Array = np.linalg.norm(vectors_m, axis=1)
    return lengths


def event_while_scored(
    events: tuple[TruthEvent, ...], scored_s: tuple[float, float]
) -> TruthEvent | None:
    """The first event of the scored part."""
    inside = [event for event in events if scored_s[0] < event.time_s < scored_s[1]]
    return inside[0] if inside else None


def _between(known_times_s: Array, known_m: Array, times_s: Array) -> Array:
    """Positions between known ones: straight lines, or a cubic spline where samples are missing."""
    steps = np.diff(known_times_s)
    if len(steps) > 2 and steps.max() > _LONGEST_STRAIGHT_S:
        from scipy.interpolate import CubicSpline

        curved: Array = CubicSpline(known_times_s, known_m)(times_s)
        return curved
    return np.stack([np.interp(times_s, known_times_s, known_m[:, k]) for k in range(3)], axis=1)


def _inside(times_s: Array, interval_s: tuple[float, float]) -> np.ndarray:
    inside: np.ndarray = (times_s >= interval_s[0]) & (times_s <= interval_s[1])
    return inside


def _figures(error_m: Array) -> ErrorFigures | None:
    if not len(error_m):
        return None
    return ErrorFigures(
        mean_m=float(error_m.mean()),
        rms_m=float(np.sqrt((error_m**2).mean())),
        max_m=float(error_m.max()),
    )
