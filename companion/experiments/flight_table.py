"""The data of one simulated flight as a table, and its figures."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.experiments.flight_task import FlightTask
from companion.report.flight_data import Array, FlightData, Ticks, Truth

_AXES = ("x", "y", "z")
_BEFORE_ENGAGEMENT = ("hold", "silence")

Column = NDArray[Any]


@dataclass(frozen=True, slots=True)
class FlightTable:
    """A flight: one row for each tick of the control from engagement on.

    Columns, where `{x,y,z}` stands for one column an axis, all in ENU:
    `time_s` since the trajectory's start (hover is negative), `phase`,
    `position_{x,y,z}_m` and `velocity_{x,y,z}_m_s` as reported,
    `true_position_{x,y,z}_m` and `true_velocity_{x,y,z}_m_s` interpolated to the tick's time,
    `desired_{x,y,z}_m`, `r2_{x,y,z}_m`, `r1_{x,y,z}_m_s`, `u_{x,y,z}`, `applied_u_{x,y,z}`,
    `y_tilde_{x,y,z}_m_s`, `sigma_hat_{x,y,z}`, `projecting`, `roll_rad`, `pitch_rad`, `thrust`,
    `plan_status` (empty where the outer controller did not run), `r_max_active`, `computed_us`,
    `wind_m_s2`.  What is not known is NaN.
    """

    task: FlightTask
    outcome: str
    """As of the flight; "failed" if it could not be flown at all."""
    note: str
    columns: dict[str, Column]
    mean_error_m: float
    """Of |y2* - y2| against the truth over the scored part; infinite if that was not flown."""
    rms_error_m: float
    max_error_m: float
    reported_mean_error_m: float = math.inf
    """The first of them against the position that the autopilot reports."""
    peak_height_error_m: float = math.nan
    """Greatest |y2* - y2| along the vertical over the scored part, against the truth."""
    reported_peak_height_error_m: float = math.nan
    """The same against the reported position."""
    flown_s: float = math.nan
    """How much of the scored part was flown."""
    scored_s: float = math.nan
    """How long the scored part is."""
    fallbacks: int = 0
    """Ticks at which something less than the controller's optimum was sent."""
    r_max_share: float = 0.0
    """Share of the plans in which the bound on the second difference of r was active."""
    wind_peak_m_s2: float = math.nan
    """Greatest acceleration by wind in the scored part."""
    tilt_slew_rms_g_s: float = math.nan
    """Root mean square of the rate of the tilt command (u_x, u_y) in the scored part."""
    event: str = ""
    """In words, what the scenario did first in the scored part; empty: nothing."""
    event_s: float = math.nan
    """When, since the trajectory's start."""
    wall_s: float = math.nan
    """How long the computer took."""


def flight_columns(data: FlightData, start_s: float) -> dict[str, Column]:
    """The columns of a flight.

    Args:
        data: the flight.
        start_s: the autopilot's time at which the trajectory starts.
    """
    ticks = data.ticks
    engaged = np.flatnonzero(~np.isin(ticks.phase, _BEFORE_ENGAGEMENT))
    rows = slice(engaged[0] if len(engaged) else len(ticks.time_s), None)
    times = ticks.time_s[rows]
    true_position, true_velocity = _truth_at(data.truth, times)
    columns: dict[str, Column] = {"time_s": times - start_s, "phase": ticks.phase[rows]}
    for name, values in _vectors(ticks, rows, true_position, true_velocity):
        stem, _, unit = name.partition("|")
        for k, axis in enumerate(_AXES):
            columns[f"{stem}_{axis}{unit}"] = values[:, k]
    return columns | {
        "projecting": ticks.projecting[rows],
        "roll_rad": ticks.roll_rad[rows],
        "pitch_rad": ticks.pitch_rad[rows],
        "thrust": ticks.thrust[rows],
        "plan_status": ticks.plan[rows],
        "r_max_active": ticks.r_max_active[rows],
        "computed_us": ticks.computed_us[rows],
        "wind_m_s2": _wind_at(data.truth, times),
    }


def tilt_slew_rms_g_s(columns: dict[str, Column], scored_s: float) -> float:
    """Root mean square of d(u_x, u_y)/dt over the scored part; NaN with too few samples.

    u is the sine of the tilt, an acceleration in units of g.
    """
    times = columns["time_s"]
    use = (times >= 0.0) & (times <= scored_s)
    u = np.stack([columns["applied_u_x"][use], columns["applied_u_y"][use]], axis=1)
    finite = np.isfinite(u).all(axis=1)
    times, u = times[use][finite], u[finite]
    if len(times) < 2:
        return math.nan
    rate = np.diff(u, axis=0) / np.diff(times)[:, None]
    return float(np.sqrt((rate**2).sum(axis=1).mean()))


def peak_height_error_m(columns: dict[str, Column], scored_s: float, position: str) -> float:
    """Greatest distance in height from the desired position over the scored part; NaN if unknown.

    Args:
        columns: of a flight.
        scored_s: length of the scored part.
        position: the column's stem: ``position`` or ``true_position``.
    """
    times = columns["time_s"]
    use = (times >= 0.0) & (times <= scored_s)
    error = np.abs(columns["desired_z_m"] - columns[f"{position}_z_m"])[use]
    error = error[np.isfinite(error)]
    return float(error.max()) if len(error) else math.nan


def _vectors(
    ticks: Ticks, rows: slice, true_position: Array, true_velocity: Array
) -> list[tuple[str, Array]]:
    """The columns of three axes; a bar stands where the axis goes into the name."""
    return [
        ("position|_m", ticks.position_enu_m[rows]),
        ("velocity|_m_s", ticks.velocity_enu_m_s[rows]),
        ("true_position|_m", true_position),
        ("true_velocity|_m_s", true_velocity),
        ("desired|_m", ticks.desired_enu_m[rows]),
        ("r2|_m", ticks.r2_enu_m[rows]),
        ("r1|_m_s", ticks.r1_enu_m_s[rows]),
        ("u", ticks.u[rows]),
        ("applied_u", ticks.applied_u[rows]),
        ("y_tilde|_m_s", ticks.y_tilde_m_s[rows]),
        ("sigma_hat", ticks.sigma_hat[rows]),
    ]


def _truth_at(truth: Truth, times_s: Array) -> tuple[Array, Array]:
    """True position (cubic, by the true velocities) and velocity (linear) at times; else NaN."""
    nothing = np.full((len(times_s), 3), np.nan)
    known, first = np.unique(truth.time_s, return_index=True)
    if len(known) < 2:
        return nothing, nothing
    position, velocity = truth.position_enu_m[first], truth.velocity_enu_m_s[first]
    k = np.clip(np.searchsorted(known, times_s, side="right") - 1, 0, len(known) - 2)
    h = (known[k + 1] - known[k])[:, None]
    t = (times_s - known[k])[:, None] / h
    at = (
        (1.0 + 2.0 * t) * (1.0 - t) ** 2 * position[k]
        + t * (1.0 - t) ** 2 * h * velocity[k]
        + t**2 * (3.0 - 2.0 * t) * position[k + 1]
        - t**2 * (1.0 - t) * h * velocity[k + 1]
    )
    speed = (1.0 - t) * velocity[k] + t * velocity[k + 1]
    outside = (times_s < known[0]) | (times_s > known[-1])
    at[outside] = np.nan
    speed[outside] = np.nan
    return at, speed


def _wind_at(truth: Truth, times_s: Array) -> Array:
    if not len(truth.wind_time_s):
        return np.full(len(times_s), np.nan)
    wind: Array = np.interp(
        times_s, truth.wind_time_s, truth.wind_acceleration_m_s2, left=np.nan, right=np.nan
    )
    return wind
