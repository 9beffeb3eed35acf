"""The paper's figure of the performance bounds, with the framework `l1`.

"We use the reference input r2 to command the quadrotor to hover for 1.5 seconds after which it
starts moving in a 3D straight line": ỹ per axis stays bounded, and y2 stays close to the ideal
y2_id = D(s) r2.
"""

from dataclasses import dataclass

import numpy as np

from companion.config.resolve import configs_folder
from companion.control.l1_adaptive import L1Gains
from companion.control.reference_model import PositionModel, discretise_position_model
from companion.experiments.flight_table import FlightTable
from companion.experiments.flight_task import FlightTask
from companion.experiments.paper.flights import Flights, vectors
from companion.experiments.paper.scale import VEHICLE, Scale
from companion.report.flight_data import Array
from companion.theory.bounds import gamma_0

HOVER_S = 1.5
SENSORS = {"exact": "exact", "noisy": None}
"""The two flights, by name."""


@dataclass(frozen=True, slots=True)
class BoundsFlight:
    """One flight; arrays over its samples from the begin of the hover on."""

    times_s: Array
    """Since the begin of the hover."""
    y_tilde_m_s: Array
    """(samples, 3)"""
    r2_m: Array
    position_m: Array
    """(samples, 3), true."""
    ideal_m: Array
    """(samples, 3): D(s) under the same r2, from the same state."""
    largest_y_tilde_m_s: Array
    """(3,)"""
    largest_distance_m: Array
    """(3,) of the position from the ideal one."""
    mean_distance_m: float
    """Of the position from the ideal one, as a vector."""
    own_gamma_0_m_s: Array
    """(3,) γ0 with the flight's own |σ̂| and |σ̂'| in the place of their bounds."""


def task(seed: int, sensors: str | None) -> FlightTask:
    """One of the two flights."""
    path = str(configs_folder() / "trajectories" / "bound-check.yaml")
    return FlightTask("l1", path, "calm", seed, VEHICLE, (("hover_s", f"{HOVER_S:g}"),), sensors)


def tasks(scale: Scale) -> list[FlightTask]:
    """What is flown."""
    return [task(scale.seeds[0], sensors) for sensors in SENSORS.values()]


def evaluate(
    flights: Flights, scale: Scale, model: PositionModel, gains: L1Gains
) -> dict[str, BoundsFlight]:
    """Figures of the flights, by name; those that were lost are left out.

    Args:
        flights: of the study.
        scale: of the study.
        model: D(s).
        gains: of the L1 controller.
    """
    tables = {name: flights.table(task(scale.seeds[0], s)) for name, s in SENSORS.items()}
    return {
        name: _evaluate(table, model, gains) for name, table in tables.items() if table is not None
    }


def _evaluate(table: FlightTable, model: PositionModel, gains: L1Gains) -> BoundsFlight:
    times = table.columns["time_s"] + HOVER_S
    r2 = vectors(table, "r2_{}_m")
    use = (times >= 0.0) & np.isfinite(r2).all(axis=1)
    times, r2 = times[use], r2[use]
    position = vectors(table, "true_position_{}_m")[use]
    velocity = vectors(table, "true_velocity_{}_m_s")[use]
    y_tilde = vectors(table, "y_tilde_{}_m_s")[use]
    ideal = ideal_response(model, times, r2, position[0], velocity[0])
    distance = np.abs(position - ideal)
    return BoundsFlight(
        times_s=times,
        y_tilde_m_s=y_tilde,
        r2_m=r2,
        position_m=position,
        ideal_m=ideal,
        largest_y_tilde_m_s=np.nanmax(np.abs(y_tilde), axis=0),
        largest_distance_m=np.nanmax(distance, axis=0),
        mean_distance_m=float(np.nanmean(np.linalg.norm(distance, axis=1))),
        own_gamma_0_m_s=_own_gamma_0(times, vectors(table, "sigma_hat_{}")[use], gains),
    )


def _own_gamma_0(times_s: Array, sigma_hat: Array, gains: L1Gains) -> Array:
    """γ0 with the largest |σ̂| and |σ̂'| of the flight for Δ and Δ_d: what it needed of them.

    An estimate of the bound: σ̂ stands for σ.
    """
    delta = np.nanmax(np.abs(sigma_hat), axis=0)
    rate = np.nanmax(np.abs(np.diff(sigma_hat, axis=0)) / np.diff(times_s)[:, None], axis=0)
    bounds = [
        gamma_0(gains.reference_model[i], gains.gamma[i], float(delta[i]), float(rate[i]))
        for i in range(3)
    ]
    return np.array([np.inf if bound is None else bound for bound in bounds])


def ideal_response(
    model: PositionModel, times_s: Array, r2_m: Array, position_m: Array, velocity_m_s: Array
) -> Array:
    """y2_id (samples, 3) of the exact D(s) with r2 held from sample to sample."""
    state = np.stack([position_m, velocity_m_s], axis=1)
    ideal = np.empty_like(r2_m)
    ideal[0] = position_m
    steps = np.round(np.diff(times_s), 6)
    matrices = {
        dt: discretise_position_model(np.array(model.m), np.array(model.gain_k), float(dt))
        for dt in np.unique(steps)
    }
    for k, dt in enumerate(steps):
        a, b = matrices[dt]
        state = np.einsum("aij,aj->ai", a, state) + b * r2_m[k][:, None]
        ideal[k + 1] = state[:, 0]
    return ideal
