"""A simple vehicle flown by one MPC or another, each of whose plans is timed."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from companion.control.frameworks import Stack, StackMemory, Tick
from companion.control.mpc import Mpc, MpcMemory, MpcRecord
from companion.control.reference_model import Array, PositionModel
from companion.control.thrust import GRAVITY_M_S2, force_from_thrust
from companion.control.thrust_laws import CollectiveThrust
from companion.experiments.nonlinear_mpc import NonlinearMemory, NonlinearMpc
from companion.experiments.point_mass import STATES, PointMass
from companion.frames import euler_from_quaternion, quaternion_from_euler
from companion.trajectories.trajectory import Trajectory
from companion.vehicle_state import VehicleState

SAMPLE_S = 0.01
"""Between two samples of the state: the L1 controller runs at each."""

_SUBSTEP_S = 0.0025
_NOISE = (1e-3,) * 3 + (1.5e-2,) * 3 + (0.0,) * (STATES - 6)
"""Standard deviations of what is measured of the state: a motion capture's, m and m/s."""


@dataclass(frozen=True, slots=True)
class Timing:
    """One timed computation."""

    method: str
    taken_us: float
    """Processor time of the thread, not wall clock: while other processes want the cores, the
    scheduler interrupts a long computation far more often than a short one."""
    iterations: int
    """Of the solver."""
    converged: bool


class TimedFlight(Protocol):
    """A vehicle under a controller."""

    def advance(self) -> list[Timing]:
        """Plan once, and fly one period of the MPC."""

    def error_m(self) -> float:
        """Distance from where the vehicle should be now."""


@dataclass(slots=True)
class SimulatedVehicle:
    """A point mass that rests, level, at the trajectory's first point at time 0."""

    trajectory: Trajectory
    noise: np.random.Generator
    model: PointMass = field(default_factory=PointMass)
    time_s: float = 0.0
    state: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Put it to the trajectory's first point."""
        if not self.state:
            start = self.trajectory.position(np.zeros(1))[0]
            self.state = [*start.tolist(), *(0.0,) * (STATES - 3)]

    def measure(self) -> list[float]:
        """The state as it is seen."""
        noise = self.noise.standard_normal(STATES).tolist()
        return [self.state[i] + _NOISE[i] * noise[i] for i in range(STATES)]

    def fly(self, inputs: Sequence[float], duration_s: float) -> None:
        """Hold an input for a while."""
        steps = round(duration_s / _SUBSTEP_S)
        for _ in range(steps):
            self.state = self.model.rk4(math, self.state, inputs, duration_s / steps)
        self.time_s += duration_s

    def error_m(self) -> float:
        """Distance from where it should be now."""
        desired = self.trajectory.position(np.array([self.time_s]))[0]
        return math.dist(desired.tolist(), self.state[:3])


@dataclass(slots=True)
class NonlinearFlight:
    """The nonlinear MPC, whose plan is all that is computed in a period."""

    method: str
    mpc: NonlinearMpc
    vehicle: SimulatedVehicle
    memory: NonlinearMemory = field(init=False)

    def __post_init__(self) -> None:
        """Begin at hover."""
        self.memory = self.mpc.start()

    def advance(self) -> list[Timing]:
        """Plan once, and fly one period."""
        state = self.vehicle.measure()
        preview = self.vehicle.trajectory.position(self.vehicle.time_s + self.mpc.preview_times_s)
        begin = time.thread_time_ns()
        self.memory, inputs, record = self.mpc.step(self.memory, state, preview)
        taken_us = (time.thread_time_ns() - begin) * 1e-3
        self.vehicle.fly(inputs, self.mpc.settings.period_s)
        return [Timing(self.method, taken_us, record.iterations, record.converged)]

    def error_m(self) -> float:
        """See the vehicle's."""
        return self.vehicle.error_m()


@dataclass(frozen=True, slots=True)
class Planned:
    """A call of `Mpc.step`."""

    memory: MpcMemory
    position_m: Array
    velocity_m_s: Array
    preview_m: Array
    record: MpcRecord
    taken_us: float


@dataclass(slots=True)
class _TimedMpc:
    """The linear MPC in its place in the stack; remembers its last call."""

    mpc: Mpc
    last: Planned | None = None

    @property
    def period_s(self) -> float:
        return self.mpc.period_s

    @property
    def model(self) -> PositionModel:
        return self.mpc.model

    def about(self, anchor_m: Array) -> "_TimedMpc":
        return _TimedMpc(self.mpc.about(anchor_m), self.last)

    @property
    def preview_times_s(self) -> Array:
        return self.mpc.preview_times_s

    def start(self, r_m: Array) -> MpcMemory:
        return self.mpc.start(r_m)

    def step(
        self,
        memory: MpcMemory,
        position_m: Array,
        velocity_m_s: Array,
        preview_m: Array,
        dt_s: float = 0.0,
    ) -> tuple[MpcMemory, Array, MpcRecord]:
        begin = time.thread_time_ns()
        advanced, r2, record = self.mpc.step(memory, position_m, velocity_m_s, preview_m, dt_s)
        taken_us = (time.thread_time_ns() - begin) * 1e-3
        self.last = Planned(memory, position_m, velocity_m_s, preview_m, record, taken_us)
        return advanced, r2, record


@dataclass(slots=True)
class LinearFlight:
    """MPC over L1: the plan alone is timed, the whole stack over a period, and a bounded plan."""

    method: str
    stack_method: str
    bounded_method: str
    stack: Stack
    mpc: Mpc
    """The stack's."""
    bounded: Mpc
    """The same with bounds that the trajectory violates: asked for the same plans, not flown."""
    vehicle: SimulatedVehicle
    memory: StackMemory = field(init=False)
    timed: _TimedMpc = field(init=False)

    def __post_init__(self) -> None:
        """Engage at rest, with the MPC under the watch."""
        self.timed = _TimedMpc(self.mpc)
        self.stack = replace(self.stack, outer=self.timed)
        self.memory = self.stack.start(self._seen(-SAMPLE_S))

    def advance(self) -> list[Timing]:
        """Plan once, and fly one period."""
        self.timed.last = None
        stack_us = 0.0
        for _ in range(round(self.mpc.period_s / SAMPLE_S)):
            tick = Tick(self._seen(self.vehicle.time_s), 0.0, 0.0)
            begin = time.thread_time_ns()
            self.memory, command, _ = self.stack.step(
                self.memory, tick, self.vehicle.trajectory.position
            )
            stack_us += (time.thread_time_ns() - begin) * 1e-3
            roll, pitch, _ = euler_from_quaternion(command.attitude_flu_to_enu)
            self.vehicle.fly((roll, pitch, self._acceleration(command.thrust)), SAMPLE_S)
        planned = self.timed.last
        if planned is None:
            return []
        solved = planned.record.status in ("closed_form", "solved")
        iterations = planned.record.iterations
        timings = [
            Timing(self.method, planned.taken_us, iterations, solved),
            Timing(self.stack_method, stack_us, iterations, solved),
        ]
        begin = time.thread_time_ns()
        _, record = self.bounded.plan(
            planned.memory, planned.position_m, planned.velocity_m_s, planned.preview_m
        )
        taken_us = (time.thread_time_ns() - begin) * 1e-3
        if any(record.constrained_axes):
            solved = record.status == "solved"
            timings.append(Timing(self.bounded_method, taken_us, record.iterations, solved))
        return timings

    def error_m(self) -> float:
        """See the vehicle's."""
        return self.vehicle.error_m()

    def _seen(self, time_s: float) -> VehicleState:
        x, y, z, vx, vy, vz, roll, pitch, roll_rate, pitch_rate = self.vehicle.measure()
        attitude = quaternion_from_euler(roll, pitch, 0.0)
        rates = (roll_rate, pitch_rate, 0.0)
        return VehicleState(time_s, (x, y, z), (vx, vy, vz), attitude, rates)

    def _acceleration(self, thrust: float) -> float:
        """What a vehicle whose hover thrust is as stated makes of a thrust field, m/s²."""
        law = self.stack.thrust
        assert isinstance(law, CollectiveThrust)
        gains = law.gains
        hover = force_from_thrust(gains.hover_thrust, gains.thrust_curve)
        return GRAVITY_M_S2 * force_from_thrust(thrust, gains.thrust_curve) / hover
