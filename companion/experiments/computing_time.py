"""Computing time of the linear MPC against a nonlinear one of the same task, horizon and rate.

The paper claims "reduced computational cost as compared to nonlinear MPC schemes".  Each method
flies trajectory 4 on a vehicle of its own, so that it is seen that all do the task; they plan in
turn, period after period, so that what else the machine does meets all of them.  What is measured
is the computing thread's processor time; nothing here profits from more threads than one, and a
BLAS that starts some (without ``OMP_NUM_THREADS=1``) only adds outliers to the stack's maximum.

What the comparison is and is not:

- Implementations are compared, not algorithms: the linear MPC is numpy, called from Python; the
  nonlinear one is CasADi's C++ with derivatives evaluated by its virtual machine.  C code compiled
  from them was found to save a sixth of a real-time iteration, for 20 s of compiling.
- The nonlinear MPC plans with the simulated vehicle's own equations and numbers, which no
  controller of a real vehicle knows; MPC-L1 knows none of them.  So the tracking errors show that
  the task is done, not which controller is better.
- Computing takes no simulated time, and there is no transport delay.
- Its bounds on velocity and position are hard, the linear MPC's soft: slack variables would make
  it slower.  On trajectory 4 none is active in either; what active ones cost the linear MPC is
  timed apart, by plans of the same states that are not flown.
- Each method runs right after others, with cold caches, as a controller does that sleeps between
  two plans.  In a loop of its own the linear MPC was found to take less than half of the time, the
  nonlinear one a tenth less.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from companion.config.resolve import FlightConfig, load_flight
from companion.control.mpc import Mpc
from companion.control.qp.osqp_solver import OsqpSolver
from companion.control.thrust import GRAVITY_M_S2, force_from_thrust
from companion.experiments.nonlinear_mpc import (
    NonlinearMpc,
    SolverName,
    load_casadi,
    quadratic_solver,
)
from companion.experiments.nonlinear_problem import NonlinearSettings
from companion.experiments.timed_flights import (
    LinearFlight,
    NonlinearFlight,
    SimulatedVehicle,
    TimedFlight,
    Timing,
)
from companion.flight.assemble import make_paper_stack, make_trajectory

MethodName = Literal[
    "linear", "linear_bounded", "linear_stack", "nonlinear_ipopt", "nonlinear_sqp", "nonlinear_rti"
]

WHAT: dict[MethodName, str] = {
    "linear": "linear MPC, Mpc.step alone",
    "linear_bounded": "its dear case: speed limits at a tenth, OSQP on each axis beyond them",
    "linear_stack": "all of MPC-L1 over one period: one plan, an L1 step and the maps every 10 ms",
    "nonlinear_ipopt": "nonlinear MPC, IPOPT, converged",
    "nonlinear_sqp": "nonlinear MPC, Gauss-Newton SQP, converged",
    "nonlinear_rti": "nonlinear MPC, one SQP iteration a plan",
}
"""The methods and what of each is timed."""

TRAJECTORY = 4
WHOLE_TRAJECTORY = 667
"""Plans that cover the 20 s of the trajectory at the shipped period of 30 ms."""
WARM_UP = 5
"""First plans, which are flown and not timed: caches are cold, and there is no warm start."""

_SOLVERS: dict[MethodName, SolverName] = {
    "nonlinear_ipopt": "ipopt",
    "nonlinear_sqp": "sqp",
    "nonlinear_rti": "rti",
}
_BINDING_SHARE = 0.1
"""Share of the vehicle's speed limits that trajectory 4 violates most of the time."""


@dataclass(frozen=True, slots=True)
class MethodTime:
    """Processor time of one method's plans; figures are None where there are none."""

    name: MethodName
    what: str
    plans: int
    """Plans that were timed."""
    median_us: float | None
    p99_us: float | None
    max_us: float | None
    ratio: float | None
    """Of the median to that of `linear`."""
    iterations: float | None
    """Mean number of the solver's iterations; the linear MPC's closed form needs none."""
    converged_share: float | None
    """Share of the plans that met the solver's tolerance; None for `nonlinear_rti`, which stops
    before."""
    mean_error_m: float | None
    """Mean distance from the desired position in closed loop; None if it was not flown."""


@dataclass(frozen=True, slots=True)
class ComputingTime:
    """The comparison; `dataclasses.asdict` of it is fit for JSON."""

    ticks: int
    """Plans that each method was flown with."""
    seed: int
    trajectory: int
    flown_s: float
    horizon: int
    """N_h."""
    period_s: float
    casadi_version: str
    quadratic_solver: str
    """Below the SQP."""
    methods: tuple[MethodTime, ...]

    def method(self, name: MethodName) -> MethodTime:
        """A method's figures."""
        return next(method for method in self.methods if method.name == name)


def measure_computing_time(ticks: int = WHOLE_TRAJECTORY, seed: int = 1) -> ComputingTime:
    """Fly trajectory 4 with each method for some plans, and time them.

    The flight begins at rest at the trajectory's beginning.  The first `WARM_UP` plans are not
    timed.  It takes about 17 ms a tick, and half a second for building the solvers.

    Args:
        ticks: plans per method, `WHOLE_TRAJECTORY` for all of it.
        seed: of the measurement noise, the same for each method.

    Raises:
        MissingExtraError: CasADi is not installed.
        ValueError: there are too few ticks for any to be timed.
    """
    if ticks <= WARM_UP:
        raise ValueError(f"{ticks} ticks are too few: more than {WARM_UP} are needed")
    casadi = load_casadi()
    config = load_flight(None, {"trajectory": TRAJECTORY}, {})
    settings = nonlinear_settings(config)
    flights = _flights(config, settings, seed)
    timings: dict[str, list[Timing]] = {name: [] for name in WHAT}
    errors_m: dict[str, list[float]] = {name: [] for name in flights}
    with _without_garbage_collection():
        for tick in range(ticks):
            for name, flight in flights.items():
                for timing in flight.advance():
                    if tick >= WARM_UP:
                        timings[timing.method].append(timing)
                errors_m[name].append(flight.error_m())
    errors_m["linear_stack"] = errors_m["linear"]
    linear_us = float(np.median([timing.taken_us for timing in timings["linear"]]))
    return ComputingTime(
        ticks=ticks,
        seed=seed,
        trajectory=TRAJECTORY,
        flown_s=ticks * settings.period_s,
        horizon=settings.horizon,
        period_s=settings.period_s,
        casadi_version=str(casadi.__version__),
        quadratic_solver=quadratic_solver(casadi),
        methods=tuple(
            _figures(name, timings[name], errors_m.get(name, []), linear_us) for name in WHAT
        ),
    )


def nonlinear_settings(config: FlightConfig) -> NonlinearSettings:
    """The task of a linear MPC's flight as the nonlinear MPC is given it.

    Raises:
        ValueError: the controller has no MPC.
    """
    mpc, vehicle, geofence = config.controller.mpc, config.vehicle, config.mission.geofence
    if mpc is None:
        raise ValueError(f"the framework {config.controller.framework} has no MPC")
    curve = vehicle.thrust_curve
    per_force = GRAVITY_M_S2 / force_from_thrust(vehicle.hover_thrust, curve)
    speed = vehicle.speed_limit_m_s
    return NonlinearSettings(
        period_s=mpc.period_s,
        horizon=mpc.horizon,
        tilt_limit_rad=float(np.radians(vehicle.tilt_limit_deg)),
        thrust_low_m_s2=per_force * force_from_thrust(vehicle.minimum_thrust, curve),
        thrust_high_m_s2=per_force * force_from_thrust(vehicle.maximum_thrust, curve),
        velocity_limit_m_s=(speed, speed, max(vehicle.climb_limit_m_s, vehicle.descent_limit_m_s)),
        box_low_m=geofence.low_m,
        box_high_m=geofence.high_m,
        q=mpc.q,
    )


def _flights(
    config: FlightConfig, settings: NonlinearSettings, seed: int
) -> dict[MethodName, TimedFlight]:
    trajectory = make_trajectory(config.mission)

    def vehicle() -> SimulatedVehicle:
        return SimulatedVehicle(trajectory, np.random.default_rng(np.random.SeedSequence(seed)))

    stack = make_paper_stack(config.controller, config.vehicle, config.mission)
    mpc = stack.outer
    assert isinstance(mpc, Mpc)
    slow = tuple(_BINDING_SHARE * limit for limit in mpc.settings.velocity_limit_m_s)
    bounded = Mpc(replace(mpc.settings, velocity_limit_m_s=slow), OsqpSolver)
    flights: dict[MethodName, TimedFlight] = {
        "linear": LinearFlight(
            "linear", "linear_stack", "linear_bounded", stack, mpc, bounded, vehicle()
        )
    }
    for name, solver in _SOLVERS.items():
        flights[name] = NonlinearFlight(name, NonlinearMpc(settings, solver), vehicle())
    return flights


@contextmanager
def _without_garbage_collection() -> Iterator[None]:
    """As `timeit`: with CasADi loaded a full collection takes 50 ms, from whoever it meets."""
    enabled = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _figures(
    name: MethodName, timings: list[Timing], errors_m: list[float], linear_us: float
) -> MethodTime:
    error_m = float(np.mean(errors_m)) if errors_m else None
    if not timings:
        return MethodTime(name, WHAT[name], 0, None, None, None, None, None, None, error_m)
    taken_us = np.array([timing.taken_us for timing in timings])
    median_us = float(np.median(taken_us))
    converged = float(np.mean([timing.converged for timing in timings]))
    return MethodTime(
        name=name,
        what=WHAT[name],
        plans=len(timings),
        median_us=median_us,
        p99_us=float(np.percentile(taken_us, 99)),
        max_us=float(taken_us.max()),
        ratio=median_us / linear_us,
        iterations=float(np.mean([timing.iterations for timing in timings])),
        converged_share=None if name == "nonlinear_rti" else converged,
        mean_error_m=error_m,
    )
