"""y1 against the simulated closed-loop reference system y1_ref, under the r1 of the flight."""

import numpy as np

from companion.control.thrust import GRAVITY_M_S2
from companion.experiments.flight_table import FlightTable
from companion.experiments.flight_task import FlightTask
from companion.experiments.paper import bounds
from companion.experiments.paper.flights import Flights, vectors
from companion.experiments.paper.guarantees import Theory
from companion.experiments.paper.results import ReferenceComparison
from companion.experiments.paper.scale import VEHICLE, Scale
from companion.report.flight_data import Array
from companion.theory.reference_system import simulate_reference

_HORIZONTAL = (0, 1)


def _tracking_task(scale: Scale) -> FlightTask:
    return FlightTask("mpc-l1", 4, "calm", scale.seeds[0], VEHICLE, sensors="exact")


def _flown(scale: Scale) -> dict[str, FlightTask]:
    return {
        "l1, hover and a 3-D line": bounds.task(scale.seeds[0], "exact"),
        "mpc-l1, trajectory 4": _tracking_task(scale),
    }


def tasks(scale: Scale) -> list[FlightTask]:
    """What is flown: without measurement noise, which y1_ref knows nothing of."""
    return list(_flown(scale).values())


def evaluate(flights: Flights, scale: Scale, theory: Theory) -> tuple[ReferenceComparison, ...]:
    """The comparisons; flights that were lost are left out."""
    tables = {name: flights.table(task) for name, task in _flown(scale).items()}
    return tuple(
        _compare(name, table, theory) for name, table in tables.items() if table is not None
    )


def _compare(name: str, table: FlightTable, theory: Theory) -> ReferenceComparison:
    times = table.columns["time_s"]
    r1 = vectors(table, "r1_{}_m_s")
    y1 = vectors(table, "true_velocity_{}_m_s")
    known = np.isfinite(r1).all(axis=1) & np.isfinite(y1).all(axis=1)
    times, r1, y1 = times[known], r1[known], y1[known]
    reference: Array = np.stack(
        [_reference(axis, times, r1[:, axis], y1[0, axis], theory) for axis in range(3)], axis=1
    )
    difference = np.abs(reference - y1)
    return ReferenceComparison(
        name,
        times,
        y1,
        reference,
        r1,
        largest_m_s=difference.max(axis=0),
        rms_m_s=np.sqrt((difference**2).mean(axis=0)),
    )


def _reference(axis: int, times_s: Array, r1_m_s: Array, start_m_s: float, theory: Theory) -> Array:
    """y1_ref of an axis at the times; the quadratic drag is its d_ref, as of that axis alone."""
    drag = theory.quadratic_drag_1_m / GRAVITY_M_S2 if axis in _HORIZONTAL else 0.0

    def disturbance(time_s: float, velocity_m_s: float) -> float:
        return -drag * velocity_m_s * abs(velocity_m_s)

    run = simulate_reference(
        theory.plants[axis],
        theory.gains.reference_model[axis],
        theory.gains.low_pass[axis],
        times_s,
        r1_m_s,
        disturbance,
        initial_velocity_m_s=start_m_s,
        step_s=2e-3,
    )
    return run.at(times_s)
