"""A flight as arrays and figures."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from companion.api.errors import InputError
from companion.report.flight_data import FlightData
from companion.report.metrics import reported_error, tracking_figures, true_error

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Ticks:
    """What the controller saw and did: one row for each sample of the state.

    Times are of the autopilot's clock, the world is ENU, the body FLU.  NaN is where a controller
    has no such thing.
    """

    time_s: Array
    """(n,) Since the autopilot's boot, s."""
    track_s: Array
    """(n,) Since the trajectory began, s; negative before."""
    phase: NDArray[np.str_]
    """(n,) Phase of the flight: approach, hover, track, settle, return …"""
    controller: NDArray[np.str_]
    """(n,) Name of the controller that flew the tick; empty where none did."""
    position_enu_m: Array
    """(n, 3) As the autopilot reports it, m."""
    velocity_enu_m_s: Array
    """(n, 3) As the autopilot reports it, m/s."""
    desired_enu_m: Array
    """(n, 3) Desired position, m."""
    r2_enu_m: Array
    """(n, 3) Position reference from the outer controller to the inner one, m."""
    u: Array
    """(n, 3) Control input: sine of the tilt to the east and to the north, and climb rate, m/s."""
    applied_u: Array
    """(n, 3) What the limits left of it."""
    sigma_hat: Array
    """(n, 3) Disturbance that the L1 controller estimates, in the unit of u."""
    y_tilde_m_s: Array
    """(n, 3) Error of the L1 controller's output predictor, m/s."""
    roll_rad: Array
    """(n,) Commanded, positive to the right, rad."""
    pitch_rad: Array
    """(n,) Commanded, positive nose down, rad."""
    thrust: Array
    """(n,) Commanded thrust field of the autopilot, 0 … 1."""
    hover_thrust: Array
    """(n,) Thrust field that is reckoned to hover, 0 … 1."""
    computed_us: Array
    """(n,) Processor's time for the tick, µs: the one column that differs from run to run."""
    on_fallback: NDArray[np.bool_]
    """(n,) What was sent was a fallback's."""

    def __repr__(self) -> str:
        """How many there are, and when."""
        return f"Ticks({_rows(self.track_s)})"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Truth:
    """What the simulation says of itself, about 100 times a second; empty for a real flight."""

    time_s: Array
    """(n,) Of the autopilot's clock, s."""
    track_s: Array
    """(n,) Since the trajectory began, s."""
    position_enu_m: Array
    """(n, 3) Where the vehicle was, m."""
    velocity_enu_m_s: Array
    """(n, 3) How it moved, m/s."""
    wind_track_s: Array
    """(m,) Since the trajectory began, s, of the row below."""
    wind_acceleration_m_s2: Array
    """(m,) How hard the wind pushed the vehicle: force over mass, m/s²."""

    def __repr__(self) -> str:
        """How many samples there are, and when."""
        return f"Truth({_rows(self.track_s)})"


@dataclass(frozen=True, slots=True)
class Figures:
    """How well a flight tracked: distance between desired and actual position.

    Against the true position in simulation, against the reported one in a real flight.  NaN where
    there is nothing to say.
    """

    mean_error_m: float
    """Mean, m."""
    rms_error_m: float
    """Root of the mean square, m."""
    max_error_m: float
    """Largest, m."""
    reported_mean_error_m: float
    """Mean against the position that the autopilot reports, m."""
    wind_peak_m_s2: float
    """Largest push of the wind, m/s²."""


@dataclass(frozen=True, slots=True, eq=False)
class Flight:
    """How a flight went."""

    outcome: str
    """landed, tracked (begun and ended in the air), aborted, or refused."""
    completed: bool
    """The trajectory was flown to its end."""
    note: str
    """Why it ended, in a sentence; often empty."""
    warnings: tuple[str, ...]
    """What a person would have been told on the way: warnings, errors, hand-overs."""
    trajectory: str
    """Its name."""
    controller: str
    """Its name."""
    vehicle: str
    """Its name, or the path of its file."""
    wind: str
    """Its scenario's name, or the path of its file."""
    seed: int
    """Of all noise."""
    scored_s: tuple[float, float] | None
    """Autopilot's times between which tracking is scored; None if it was never begun."""
    figures: Figures
    """Of the whole scored part.  A flight that was not completed has infinite errors; `score`
    says how it tracked as long as it did."""
    ticks: Ticks
    """The controller's records."""
    truth: Truth
    """The simulation's."""
    folder: Path | None
    """Of its logs, `result.json`, `report.html` and `track.png`; None: all was kept in memory."""
    data: FlightData = field(repr=False, compare=False)
    """The arrays as the reports read them.  Not part of the stable surface."""

    @property
    def mean_error_m(self) -> float:
        """Mean tracking error, m (`figures.mean_error_m`)."""
        return self.figures.mean_error_m

    def error(self) -> tuple[Array, Array]:
        """Tracking error over time.

        Returns:
            Times since the trajectory began (n,), s, and distances (n,), m: of the scored part,
            against the truth where there is one.
        """
        if self.scored_s is None:
            return np.empty(0), np.empty(0)
        has_truth = len(self.data.truth.time_s) > 0
        times, error = (true_error if has_truth else reported_error)(self.data, self.scored_s)
        return times - self.scored_s[0], error


def score(flight: Flight, interval_s: tuple[float, float] | None = None) -> Figures:
    """Score a flight, or a part of it.

    Args:
        flight: from `fly` or `read_flight`.
        interval_s: first and last time since the trajectory began, s; None: the scored part, as
            far as it was flown.

    Raises:
        InputError: the flight never began its trajectory, or the interval is none.
    """
    if flight.scored_s is None:
        raise InputError(f"the flight never began its trajectory: {flight.note or flight.outcome}")
    begin_s, end_s = flight.scored_s
    if interval_s is not None:
        if not interval_s[0] < interval_s[1]:
            raise InputError(f"the interval {interval_s} s is empty. Give its first time first.")
        begin_s, end_s = begin_s + interval_s[0], begin_s + interval_s[1]
    return figures_of(flight.data, (begin_s, end_s))


def _rows(track_s: Array) -> str:
    if not len(track_s):
        return "no rows"
    return f"{len(track_s)} rows, {track_s[0]:.1f} … {track_s[-1]:.1f} s"


def figures_of(data: FlightData, scored_s: tuple[float, float] | None) -> Figures:
    """The figures between two times of the autopilot's clock; all NaN without them."""
    nan = math.nan
    if scored_s is None:
        return Figures(nan, nan, nan, nan, nan)
    found = tracking_figures(data, scored_s)
    best = found.against_truth or found.as_reported
    return Figures(
        mean_error_m=nan if best is None else best.mean_m,
        rms_error_m=nan if best is None else best.rms_m,
        max_error_m=nan if best is None else best.max_m,
        reported_mean_error_m=nan if found.as_reported is None else found.as_reported.mean_m,
        wind_peak_m_s2=nan if found.wind_peak_m_s2 is None else found.wind_peak_m_s2,
    )


def ticks_of(data: FlightData, began_s: float) -> Ticks:
    """The controller's records; the trajectory began at a time of the autopilot's clock."""
    t = data.ticks
    flown_by = t.watched.controller if t.watched is not None else np.full(len(t.time_s), "")
    return Ticks(
        time_s=t.time_s,
        track_s=t.time_s - began_s,
        phase=t.phase,
        controller=flown_by,
        position_enu_m=t.position_enu_m,
        velocity_enu_m_s=t.velocity_enu_m_s,
        desired_enu_m=t.desired_enu_m,
        r2_enu_m=t.r2_enu_m,
        u=t.u,
        applied_u=t.applied_u,
        sigma_hat=t.sigma_hat,
        y_tilde_m_s=t.y_tilde_m_s,
        roll_rad=t.roll_rad,
        pitch_rad=t.pitch_rad,
        thrust=t.thrust,
        hover_thrust=t.hover_thrust,
        computed_us=t.computed_us,
        on_fallback=t.on_fallback,
    )


def truth_of(data: FlightData, began_s: float) -> Truth:
    """The simulation's truth; the trajectory began at a time of the autopilot's clock."""
    t = data.truth
    return Truth(
        time_s=t.time_s,
        track_s=t.time_s - began_s,
        position_enu_m=t.position_enu_m,
        velocity_enu_m_s=t.velocity_enu_m_s,
        wind_track_s=t.wind_time_s - began_s,
        wind_acceleration_m_s2=t.wind_acceleration_m_s2,
    )
