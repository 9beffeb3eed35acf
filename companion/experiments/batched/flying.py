"""Flies batches: all vehicles of one controller side by side, step by step."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.control.reference_model import Array
from companion.control.thrust_laws import CollectiveThrust
from companion.experiments.batched.air import Air
from companion.experiments.batched.draws import Draws
from companion.experiments.batched.inner_laws import make_inner
from companion.experiments.batched.outer_laws import PlanningLaw, make_outer
from companion.experiments.batched.plant import STEP_S, Fleet, make_plants
from companion.experiments.batched.score import Score
from companion.experiments.batched.task import BatchTask, Laws, Vehicle, read_tasks, sensor_noise
from companion.experiments.batched.thrust_law import ThrustLaw
from companion.experiments.flight_store import Summary
from companion.trajectories.trajectory import Trajectory

AT_ONCE = 1000
"""Vehicles side by side: more fit into no cache and are no quicker."""
_GRID_S = 0.00025
"""To which times of the reference are rounded: 0.5 mm at most at 2 m/s."""
_STREAM = 0
_BREACH_M = 0.5
_LONGEST_CARRIED_S = 0.5


@dataclass(frozen=True, slots=True)
class Batch:
    """What a batch was, beside its rows."""

    rows: list[Summary]
    constrained_share: tuple[float, ...]
    """By row: of its plans, those that a solver made."""


def fly_batch(tasks: Sequence[BatchTask]) -> list[Summary]:
    """Fly many simplified vehicles, each from a hover along its trajectory.

    A `Summary` is what a row of a campaign is made of (`campaigns.results.row_of`, with the engine
    "batched"); its key is the task's, errors of a vehicle that was lost are infinite, and `wall_s`
    is its share of the batch's time.  Vehicles of the same controller, settings and vehicle file
    fly side by side: a parameter that is a setting of the controller takes this mode's speed away.

    Args:
        tasks: in any order; the rows are in the same one.

    Raises:
        ConfigError: a task can't be flown, or asks for what is not modelled here; nothing was
            flown.  `check_batch` finds it out beforehand.
    """
    return fly_batch_told(tasks).rows


def fly_batch_told(tasks: Sequence[BatchTask]) -> Batch:
    """As `fly_batch`, with what else is to be said; raises the same."""
    rows: dict[int, Summary] = {}
    shares: dict[int, float] = {}
    for laws, members in read_tasks(tasks):
        for begin in range(0, len(members), AT_ONCE):
            part = members[begin : begin + AT_ONCE]
            flown, constrained = _fly(laws, [vehicle for _, vehicle in part])
            for (where, _), row, share in zip(part, flown, constrained, strict=True):
                rows[where], shares[where] = row, share
    order = range(len(tasks))
    return Batch([rows[k] for k in order], tuple(shares[k] for k in order))


def _fly(laws: Laws, vehicles: Sequence[Vehicle]) -> tuple[list[Summary], list[float]]:
    started = time.perf_counter()
    mission, stack = laws.config.mission, laws.stack
    assert isinstance(stack.thrust, CollectiveThrust)
    limits, hover_s = stack.limits, mission.hover_s
    seeds = [vehicle.task.flight.seed for vehicle in vehicles]
    plants = make_plants(laws, vehicles)
    desired = _Desired([vehicle.trajectory for vehicle in vehicles], hover_s)
    fleet = Fleet(plants, Air([v.winds for v in vehicles], seeds, STEP_S), desired.at_step(0))
    loop_delay_s = np.minimum(plants.link_delay_s, _LONGEST_CARRIED_S)
    outer = make_outer(stack.outer, laws.make_solver, fleet.position_m, loop_delay_s)
    inner = make_inner(stack.inner, len(vehicles))
    thrust = ThrustLaw(stack.thrust.gains, fleet.velocity_m_s[2])
    scored = np.array([vehicle.trajectory.scored_s for vehicle in vehicles])
    score = Score(scored, hover_s)
    noise, draws = _noise(), Draws(seeds, _STREAM, 8)
    refused = np.array([bool(vehicle.problems) for vehicle in vehicles])
    score.lose(refused, "")
    slow = plants.link_delay_s > mission.supervisor.loop_delay_limit_s
    score.lose(slow, "the loop's delay is above supervisor.loop_delay_limit_s")
    low = np.array(mission.geofence.low_m)[:, None] - _BREACH_M
    high = np.array(mission.geofence.high_m)[:, None] + _BREACH_M

    r2 = fleet.position_m.copy()
    tilt, field = fleet.tilt_rad, fleet.hover_field
    sampled_s = ran_s = -STEP_S
    due_s, samples = 0.0, 0
    for k in range(math.ceil((hover_s + float(scored.max())) / STEP_S) + 1):
        now_s = k * STEP_S
        if k * STEP_S * mission.state_rate_hz >= samples - 1e-9:
            samples += 1
            errors = noise * draws.next()
            position, velocity = fleet.position_m + errors[:3], fleet.velocity_m_s + errors[3:6]
            reported = fleet.tilt_rad + errors[6:]
            dt_s = round(now_s - sampled_s, 4)
            if now_s >= due_s - 1e-6:
                r2 = outer.step(now_s, position, velocity, desired, now_s - ran_s)
                period = outer.period_s
                late = math.floor((now_s - due_s) / period + 1e-6) if period > 0.0 else 0
                due_s = due_s + (late + 1) * period if period > 0.0 else now_s
                ran_s = now_s
            u = inner.step(r2, position, velocity, dt_s)
            u = _limited(u, math.sin(limits.tilt_rad), -limits.descent_m_s, limits.climb_m_s)
            inner.take(u)
            tilt = np.arcsin(np.stack([-u[1], u[0]]))
            cosine = np.cos(reported[0]) * np.cos(reported[1])
            field = thrust.step(u[2], velocity[2], cosine, dt_s)
            score.sample(now_s, position, desired.at_step(k), u, dt_s)
            sampled_s = now_s
        fleet.step(tilt, field)
        wanted = desired.at_step(k + 1)
        score.step(now_s + STEP_S, fleet.position_m, wanted, fleet.wind_m_s2)
        within = (fleet.position_m >= low) & (fleet.position_m <= high)
        outside: NDArray[np.bool_] = np.logical_not(within.all(axis=0))
        if outside.any():
            score.lose(outside, f"{_BREACH_M:g} m outside the geofence")
        if score.lost.any():
            fleet.park(score.lost, wanted)
            if isinstance(outer, PlanningLaw):
                outer.lost = score.lost
    wall_s = (time.perf_counter() - started) / len(vehicles)
    plans = np.maximum(outer.plans, 1)
    rows = [
        score.row(k, vehicle, float(outer.at_r_max[k] / plans[k]), int(outer.failed[k]), wall_s)
        for k, vehicle in enumerate(vehicles)
    ]
    return rows, (outer.constrained / plans).tolist()


def _limited(u: Array, most: float, lowest: float, highest: float) -> Array:
    """`companion.control.tilt.limit_tilt` and the limits of the climb rate."""
    length = np.hypot(u[0], u[1])
    scale = np.where(length > most, most / np.maximum(length, most), 1.0)
    return np.stack([u[0] * scale, u[1] * scale, np.clip(u[2], lowest, highest)])


def _noise() -> Array:
    """Of position, velocity, roll and pitch, (8, 1)."""
    position, velocity, tilt = sensor_noise()
    return np.array([*position, *velocity, tilt, tilt])[:, None]


class _Desired:
    """Desired positions of all vehicles, looked up on a grid of time; the hover comes first."""

    def __init__(self, trajectories: Sequence[Trajectory], hover_s: float) -> None:
        self._hover_s = hover_s
        kinds = list({id(one): one for one in trajectories}.values())
        self._size = 1 + math.ceil(max(kind.end_s for kind in kinds) / _GRID_S)
        times: Array = _GRID_S * np.arange(self._size, dtype=np.float64)
        self._grid = np.concatenate([kind.position(times) for kind in kinds]).T.copy()
        where = {id(kind): k for k, kind in enumerate(kinds)}
        self._begin = np.array([where[id(one)] * self._size for one in trajectories])

    def __call__(self, times_s: Array) -> Array:
        """At times (…, vehicles) since the beginning of the hover: (3, …, vehicles)."""
        index = np.rint((times_s - self._hover_s) * (1.0 / _GRID_S)).astype(np.int64)
        np.clip(index, 0, self._size - 1, out=index)
        found: Array = self._grid[:, index + self._begin]
        return found

    def at_step(self, k: int) -> Array:
        """At a step of the plant: (3, vehicles)."""
        index = round((k * STEP_S - self._hover_s) / _GRID_S)
        found: Array = self._grid[:, self._begin + min(max(index, 0), self._size - 1)]
        return found
