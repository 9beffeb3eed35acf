"""A load taken up in flight, and the adaptation in a hover without excitation."""

import math
from dataclasses import dataclass

import numpy as np

from companion.config.resolve import configs_folder
from companion.control.reference_model import PositionModel
from companion.control.thrust import GRAVITY_M_S2
from companion.experiments.flight_table import FlightTable
from companion.experiments.flight_task import FlightTask
from companion.experiments.paper.bounds import ideal_response
from companion.experiments.paper.flights import Flights, scored, vectors
from companion.experiments.paper.scale import VEHICLE, Scale
from companion.experiments.paper.statistics import Spread, spread
from companion.report.flight_data import Array

CONTROLLERS = ("mpc-l1", "mpc-pid")
TRAJECTORY = 4
LOAD_AT_S = 5.0
"""Into the trajectory, in a flight that begins in the air; see configs/scenarios/mass-step.yaml."""
_SHORTLY_S = 2.0
_SETTLED_S = 10.0
"""The scored part from here on is what is called settled."""
_STILL_S = 5.0
"""Last part of the hover, over which its settled values are taken."""
_STILL_NOISY_S = 15.0
"""The same with noise, which takes longer to average out."""
_CLOSE = 0.1


@dataclass(frozen=True, slots=True)
class LoadStep:
    """Distances |y2* - y2| of a controller, m; each over the seeds."""

    shortly_after: Spread
    """Mean over the two seconds after the load was taken up."""
    settled: Spread
    """Mean from five seconds after it to the end."""
    settled_without: Spread
    """The same part of the same flight without the load."""
    from_ideal: Spread
    """Mean |y2 - y2_id| over the settled part, y2_id = D(s) r2; infinite of MPC-PID."""
    from_ideal_without: Spread
    largest_sag_m: float
    """Greatest distance below the desired height after the load, of the first seed."""
    times_s: Array
    """Of the first seed."""
    height_error_m: Array
    """True minus desired height."""
    sigma_hat_z: Array


@dataclass(frozen=True, slots=True)
class HoverConvergence:
    """σ̂ in a hover in steady wind: nothing moves, and yet it finds the push."""

    expected_sine: float
    """The wind's push over g: what the tilt must make up for."""
    settled_sine: float
    """Length of the mean horizontal σ̂ over the last seconds, noise-free."""
    settled_noisy_sine: float
    """The same with measurement noise, less that of a calm hover of the same seed: the trim."""
    settled_offset_m: float
    """Greatest distance from the hover's point over the last seconds, noise-free."""
    settling_s: float
    """After the take-over, until the horizontal σ̂ stays within a tenth of its settled value."""
    times_s: Array
    """Since the take-over; noise-free."""
    sigma_hat: Array
    """(samples, 3), noise-free."""
    noisy_times_s: Array
    noisy_sigma_hat: Array
    largest_speed_m_s: float
    """Of the vehicle over the last seconds, noise-free: how little excitation there is."""


@dataclass(frozen=True, slots=True)
class ChangingDynamics:
    """Both experiments."""

    load: dict[str, LoadStep]
    """By controller."""
    hover: HoverConvergence | None
    """None if it was not flown to its end."""


def _loaded(controller: str, seed: int) -> FlightTask:
    return FlightTask(controller, TRAJECTORY, "mass-step", seed, VEHICLE)


def _unloaded(controller: str, seed: int) -> FlightTask:
    return FlightTask(controller, TRAJECTORY, "calm", seed, VEHICLE)


def _hover(seed: int, sensors: str | None, wind: str = "wind3") -> FlightTask:
    path = str(configs_folder() / "trajectories" / "hover.yaml")
    return FlightTask("mpc-l1", path, wind, seed, VEHICLE, sensors=sensors)


def tasks(scale: Scale) -> list[FlightTask]:
    """What is flown."""
    flown = [
        make(controller, seed)
        for controller in CONTROLLERS
        for make in (_loaded, _unloaded)
        for seed in scale.seeds
    ]
    seed = scale.seeds[0]
    return [*flown, _hover(seed, "exact"), _hover(seed, None), _hover(seed, None, "calm")]


def evaluate(flights: Flights, scale: Scale, model: PositionModel) -> ChangingDynamics:
    """Figures of both; model: D(s) of MPC-L1."""
    load = {controller: _load_step(flights, scale, controller, model) for controller in CONTROLLERS}
    return ChangingDynamics(
        {controller: step for controller, step in load.items() if step is not None},
        _convergence(flights, scale.seeds[0]),
    )


def _load_step(
    flights: Flights, scale: Scale, controller: str, model: PositionModel
) -> LoadStep | None:
    after, settled, without = [], [], []
    ideal, ideal_without = (
        [
            _from_ideal(flights.table(make(controller, seed)), model)
            if controller == "mpc-l1"
            else math.inf
            for seed in scale.seeds
        ]
        for make in (_loaded, _unloaded)
    )
    for seed in scale.seeds:
        times, error = _error(flights, _loaded(controller, seed))
        after.append(_mean(error, (times >= LOAD_AT_S) & (times < LOAD_AT_S + _SHORTLY_S)))
        settled.append(_mean(error, times >= _SETTLED_S))
        times, error = _error(flights, _unloaded(controller, seed))
        without.append(_mean(error, times >= _SETTLED_S))
    table = flights.table(_loaded(controller, scale.seeds[0]))
    if table is None:
        return None
    rows = scored(table)
    columns = table.columns
    height = columns["true_position_z_m"][rows].astype(float) - columns["desired_z_m"][rows]
    shown = columns["time_s"][rows]
    return LoadStep(
        spread(after),
        spread(settled),
        spread(without),
        spread(ideal),
        spread(ideal_without),
        largest_sag_m=float(-np.nanmin(height[shown >= LOAD_AT_S], initial=0.0)),
        times_s=shown,
        height_error_m=height,
        sigma_hat_z=columns["sigma_hat_z"][rows].astype(float),
    )


def _from_ideal(table: FlightTable | None, model: PositionModel) -> float:
    """Mean distance of the settled part from the ideal system under the same r2."""
    if table is None:
        return math.inf
    r2 = vectors(table, "r2_{}_m")
    known = np.isfinite(r2).all(axis=1)
    times, position = table.columns["time_s"][known], vectors(table, "true_position_{}_m")[known]
    velocity = vectors(table, "true_velocity_{}_m_s")[known]
    ideal = ideal_response(model, times, r2[known], position[0], velocity[0])
    settled = (times >= _SETTLED_S) & (times <= table.scored_s)
    return float(np.linalg.norm(position - ideal, axis=1)[settled].mean())


def _error(flights: Flights, task: FlightTask) -> tuple[Array, Array]:
    """Times and distances; empty arrays of a lost flight."""
    table = flights.table(task)
    if table is None:
        return np.empty(0), np.empty(0)
    rows = scored(table)
    difference = vectors(table, "desired_{}_m")[rows] - vectors(table, "true_position_{}_m")[rows]
    error: Array = np.linalg.norm(difference, axis=1)
    return table.columns["time_s"][rows], error


def _mean(values: Array, use: np.ndarray) -> float:
    chosen = values[use]
    chosen = chosen[np.isfinite(chosen)]
    return float(chosen.mean()) if len(chosen) else math.inf


def _convergence(flights: Flights, seed: int) -> HoverConvergence | None:
    clean, noisy, calm = (
        flights.table(task)
        for task in (_hover(seed, "exact"), _hover(seed, None), _hover(seed, None, "calm"))
    )
    if clean is None or noisy is None or calm is None:
        return None
    times, sigma = _since_take_over(clean.columns["time_s"], vectors(clean, "sigma_hat_{}"))
    noisy_times, noisy_sigma = _since_take_over(
        noisy.columns["time_s"], vectors(noisy, "sigma_hat_{}")
    )
    last = times >= times[-1] - _STILL_S
    final = sigma[last, :2].mean(axis=0)
    off = np.linalg.norm(sigma[:, :2] - final, axis=1) > _CLOSE * np.linalg.norm(final)
    settling = float(times[np.flatnonzero(off)[-1]]) if off.any() else 0.0
    speed = np.linalg.norm(vectors(clean, "true_velocity_{}_m_s"), axis=1)
    push = clean.columns["wind_m_s2"].astype(float)
    off_point = vectors(clean, "true_position_{}_m") - vectors(clean, "desired_{}_m")
    trimmed = _settled_mean(noisy) - _settled_mean(calm)
    return HoverConvergence(
        expected_sine=float(np.nanmean(push[-len(times) :][last])) / GRAVITY_M_S2,
        settled_sine=float(np.linalg.norm(final)),
        settled_noisy_sine=float(np.linalg.norm(trimmed)),
        settled_offset_m=float(np.nanmax(np.linalg.norm(off_point, axis=1)[-len(times) :][last])),
        settling_s=settling,
        times_s=times,
        sigma_hat=sigma,
        noisy_times_s=noisy_times,
        noisy_sigma_hat=noisy_sigma,
        largest_speed_m_s=float(np.nanmax(speed[-len(times) :][last])),
    )


def _settled_mean(table: FlightTable) -> Array:
    """Mean horizontal σ̂ of the last seconds of a noisy hover."""
    times, sigma = _since_take_over(table.columns["time_s"], vectors(table, "sigma_hat_{}"))
    mean: Array = sigma[times >= times[-1] - _STILL_NOISY_S, :2].mean(axis=0)
    return mean


def _since_take_over(times_s: Array, values: Array) -> tuple[Array, Array]:
    """From the first sample on that has a value, with times since then."""
    first = int(np.flatnonzero(np.isfinite(values).all(axis=1))[0])
    return times_s[first:] - times_s[first], values[first:]
