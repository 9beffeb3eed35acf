"""How fast a whole simulated flight goes, and what takes the time.

    python benchmarks/lockstep.py [--repeats 5] [--trajectory 4] [--json] [--keep]

Boot to disarm in lockstep, through packed MAVLink frames, with the flight's log written: PX4 and
ArduPilot, the equations compiled by numba and plain, in turns in one process.  Then the same
flights once more under a sampling profiler, which says whose code the processor was in.

Beside them, in the same rounds, rotorpy steps the same vehicle: its dynamics alone, and under its
own SE3 controller; and so does this package's plant alone.  A step of rotorpy is not a step of a
flight: see `LEAVES_OUT`.

Figures are of processor time, not of a clock on the wall, so that other processes matter little.
"""

import argparse
import os
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from types import FrameType
from typing import Any

import numpy as np

from benchmarks.harness import Report, main
from companion.config.resolve import load_flight
from companion.flight.assemble import make_trajectory
from companion.flight.beginning import log_begins_us, shim_options
from companion.flight.observer import SilentObserver
from companion.flight.records import CHANNELS
from companion.lockstep import fly_in_lockstep
from companion.recording.flight_log import FlightLog
from companion.trajectories.harmonic import TEST_TRAJECTORIES
from sitl_shim.compiled import VARIABLE
from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.vehicle import VehicleModel, load_vehicle
from sitl_shim.wind.field import SteadyWind

AUTOPILOTS = ("px4", "ardupilot")
GOALS = {"compiled": 40.0, "plain": 15.0}
STEP_S = 0.004
STEPS = 1000
"""Of a simulation alone, in each round."""
SAMPLE_S = 0.001
PARTS = (
    ("sitl_shim/plant/", "plant, wind, estimator"),
    ("sitl_shim/wind/", "plant, wind, estimator"),
    ("sitl_shim/sensors/", "plant, wind, estimator"),
    ("sitl_shim/autopilot/", "autopilot"),
    ("sitl_shim/mavlink/", "the vehicle's messages"),
    ("sitl_shim/", "the simulation's own loop"),
    ("companion/control/", "controllers"),
    ("companion/trajectories/", "controllers"),
    ("companion/mavlink/", "the companion's messages"),
    ("companion/link/", "the companion's messages"),
    ("companion/recording/", "log"),
    ("companion/flight/clock", "event loop"),
    ("companion/", "the companion's flight"),
    ("asyncio/", "event loop"),
)
"""Whose code a sample was in, by the innermost frame of which this is known."""
LEAVES_OUT = {
    "rotorpy, dynamics": (
        "Multirotor.step with the rotor speeds of a flight under its controller, and its default "
        "integrator: scipy's adaptive RK45 within each step; rotor lag, drag. No sensors, no "
        "autopilot, no messages, no companion, no log."
    ),
    "rotorpy, one step each": (
        "The same, its integrator kept to one step of fifth order in each of 4 ms."
    ),
    "rotorpy, SE3": (
        "The first under its geometric controller, which reads the true state at every step (the "
        "trajectory's points are made beforehand). No estimator, no autopilot, no messages, no log."
    ),
    "plant alone": (
        "This package's Plant.step at constant rotor commands: fourth-order Runge-Kutta, rotor "
        "lag, drag, battery, ground contact. Nothing else of a flight."
    ),
    "flight": (
        "All of it: plant, wind, estimator's noise, autopilot, streams, packing and parsing, "
        "transport delays, the companion's whole control tick, its records and its log."
    ),
}


@dataclass(frozen=True, slots=True)
class Flown:
    """One flight."""

    simulated_s: float
    processor_s: float
    wall_s: float

    @property
    def speed(self) -> float:
        """Simulated seconds per second of processor time."""
        return self.simulated_s / self.processor_s


def options(parser: argparse.ArgumentParser) -> None:
    """The benchmark's own."""
    parser.add_argument("--repeats", type=int, default=5, help="rounds [5]")
    parser.add_argument("--trajectory", type=int, default=4, help="1 ... 5 [4]")


def run(asked: argparse.Namespace) -> Report:
    """Fly in turns, and step beside it."""
    kinds = ("compiled", "plain") if find_spec("numba") else ("plain",)
    steppers = _steppers(kinds, asked.trajectory)
    flights: dict[tuple[str, str], list[Flown]] = {}
    steps: dict[str, list[float]] = {name: [] for name in steppers}
    first_s = {}
    for kind in kinds:
        for autopilot in AUTOPILOTS:
            begin = time.perf_counter()
            fly(autopilot, kind, asked.trajectory)  # imports, compiles or loads what is compiled
            first_s[f"{autopilot}, {kind}"] = time.perf_counter() - begin
    for _ in range(asked.repeats):
        for kind in kinds:
            for autopilot in AUTOPILOTS:
                flown = fly(autopilot, kind, asked.trajectory)
                flights.setdefault((autopilot, kind), []).append(flown)
        for name, stepper in steppers.items():
            steps[name].append(stepper())
    shares = {
        (autopilot, kind): profile(autopilot, kind, asked.trajectory)
        for kind in kinds
        for autopilot in AUTOPILOTS
    }
    figures = {
        "trajectory": asked.trajectory,
        "repeats": asked.repeats,
        "first_flight_wall_s": first_s,
        "flights": [
            _flight_figures(autopilot, kind, flown, shares[autopilot, kind])
            for (autopilot, kind), flown in flights.items()
        ],
        "steps_per_s": {name: _spread(rates) for name, rates in steps.items()},
        "step_ms": STEP_S * 1e3,
        "what_each_does": LEAVES_OUT,
    }
    if not find_spec("numba"):
        figures["left_out"] = "the compiled equations: numba is not installed (extra speed)"
    return figures, _lines(figures)


def fly(autopilot: str, kind: str, trajectory: int) -> Flown:
    """One flight from boot to disarm, its log written to a folder that is thrown away."""
    with tempfile.TemporaryDirectory() as made, _compiling(kind):
        config = load_flight(None, {"trajectory": trajectory, "autopilot": autopilot}, {})
        shim = shim_options(config, lockstep=True)
        if shim is None:
            raise ValueError("the flight needs the embedded shim")
        course = make_trajectory(config.mission)
        log = FlightLog(Path(made), CHANNELS, base_us=log_begins_us(lockstep=True))
        wall, processor = time.perf_counter(), time.process_time()
        try:
            outcome = fly_in_lockstep(config, course, log, SilentObserver(), shim)
        finally:
            log.close()
        return Flown(outcome.flight_s, time.process_time() - processor, time.perf_counter() - wall)


def profile(autopilot: str, kind: str, trajectory: int) -> dict[str, float]:
    """Share of the processor's time of each part of one more flight."""
    seen: Counter[str] = Counter()

    def sample(_: int, frame: FrameType | None) -> None:
        seen[_part_of(frame)] += 1

    before = signal.signal(signal.SIGPROF, sample)
    signal.setitimer(signal.ITIMER_PROF, SAMPLE_S, SAMPLE_S)
    try:
        fly(autopilot, kind, trajectory)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
    total = sum(seen.values())
    return {part: count / total for part, count in seen.most_common()}


def _part_of(frame: FrameType | None) -> str:
    while frame is not None:
        path = frame.f_code.co_filename.replace(os.sep, "/")
        for piece, part in PARTS:
            if f"/{piece}" in path:
                return part
        frame = frame.f_back
    return "the rest"


@contextmanager
def _compiling(kind: str) -> Iterator[None]:
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = "1" if kind == "compiled" else "0"
    try:
        yield
    finally:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before


# --- simulations alone ---


def _steppers(kinds: tuple[str, ...], trajectory: int) -> dict[str, Callable[[], float]]:
    """Simulations that give their steps per second of processor time."""
    vehicle = load_vehicle("bebop2")
    found: dict[str, Callable[[], float]] = {}
    for kind in kinds:
        found[f"plant alone, {kind}"] = _plant_stepper(vehicle, kind)
    if find_spec("rotorpy"):
        found |= _rotorpy_steppers(vehicle, trajectory)
    return found


def _plant_stepper(vehicle: VehicleModel, kind: str) -> Callable[[], float]:
    with _compiling(kind):
        plant = Plant(
            vehicle, SteadyWind((0.0, 0.0, 0.0)), seed=0, airborne_at_enu_m=(0.0, 0.0, 100.0)
        )
    hover = (vehicle.hover_signal,) * 4

    def step() -> float:
        begin = time.process_time()
        for _ in range(STEPS):
            plant.step(hover)
        return STEPS / (time.process_time() - begin)

    return step


def _rotorpy_steppers(vehicle: VehicleModel, trajectory: int) -> dict[str, Callable[[], float]]:
    """Rotorpy's quadrotor with this vehicle's numbers, on a trajectory."""
    from rotorpy.controllers.quadrotor_control import SE3Control  # type: ignore[import-untyped]
    from rotorpy.vehicles.multirotor import Multirotor  # type: ignore[import-untyped]

    parameters = rotorpy_parameters(vehicle)
    hover_rad_s = np.sqrt(vehicle.mass_kg * 9.81 / 4.0 / parameters["k_eta"])
    points = _flat_outputs(trajectory)
    start = {
        "x": points[0]["x"],
        "v": points[0]["x_dot"],
        "q": np.array([0.0, 0.0, 0.0, 1.0]),
        "w": np.zeros(3),
        "wind": np.zeros(3),
        "rotor_speeds": np.full(4, hover_rad_s),
    }
    controller = SE3Control(parameters)
    body = Multirotor(parameters, initial_state=start)
    coarse = Multirotor(
        parameters,
        initial_state=start,
        integrator_kwargs={"method": "RK45", "first_step": STEP_S, "rtol": 1.0, "atol": 1.0},
    )
    commands = []
    state = start
    for k, point in enumerate(points):
        commands.append(controller.update(k * STEP_S, state, point))
        state = body.step(state, commands[-1], STEP_S)
    if not np.linalg.norm(state["x"] - points[-1]["x"]) < 1.0:
        raise ValueError("rotorpy's controller does not fly the trajectory")

    def fly_it() -> float:
        state = start
        begin = time.process_time()
        for k, point in enumerate(points):
            state = body.step(state, controller.update(k * STEP_S, state, point), STEP_S)
        return len(points) / (time.process_time() - begin)

    def repeat(body: Multirotor) -> float:
        state = start
        begin = time.process_time()
        for command in commands:
            state = body.step(state, command, STEP_S)
        return len(commands) / (time.process_time() - begin)

    return {
        "rotorpy, dynamics": lambda: repeat(body),
        "rotorpy, one step each": lambda: repeat(coarse),
        "rotorpy, SE3": fly_it,
    }


def rotorpy_parameters(vehicle: VehicleModel) -> dict[str, Any]:
    """A vehicle as rotorpy describes one.

    Its thrust goes with the square of a rotor's speed, where this vehicle's is linear in the
    signal; full thrust, lag, arms, mass, inertia and drag at hover are the same.
    """
    full_rad_s = 1000.0
    k_eta = vehicle.propulsion.max_thrust_n / full_rad_s**2
    hover_rad_s = np.sqrt(vehicle.mass_kg * 9.81 / 4.0 / k_eta)
    dx, _, dz = vehicle.drag.linear_n_s_m
    ix, iy, iz = vehicle.inertia_kg_m2
    quadratic = vehicle.drag.quadratic_n_s2_m2
    return {
        "mass": vehicle.mass_kg,
        **{"Ixx": ix, "Iyy": iy, "Izz": iz, "Ixy": 0.0, "Ixz": 0.0, "Iyz": 0.0},
        "num_rotors": 4,
        "rotor_pos": {
            f"r{k}": np.array(rotor.position_flu_m) for k, rotor in enumerate(vehicle.rotors, 1)
        },
        "rotor_directions": np.array([-1 if r.spin == "ccw" else 1 for r in vehicle.rotors]),
        "rI": np.zeros(3),
        **{"c_Dx": quadratic, "c_Dy": quadratic, "c_Dz": quadratic},
        "k_eta": k_eta,
        "k_m": k_eta * vehicle.propulsion.torque_per_thrust_m,
        "k_d": dx / (4.0 * hover_rad_s),
        "k_z": dz / (4.0 * hover_rad_s),
        **{"k_h": 0.0, "k_flap": 0.0},
        "tau_m": vehicle.propulsion.time_constant_s,
        **{"rotor_speed_min": 0.0, "rotor_speed_max": full_rad_s, "motor_noise_std": 0.0},
    }


def _flat_outputs(trajectory: int) -> list[dict[str, Any]]:
    """Points of a trajectory, a step apart, as rotorpy's controller takes them."""
    times_s = np.arange(STEPS, dtype=np.float64) * STEP_S
    motion = TEST_TRAJECTORIES[trajectory].motion(times_s)
    nothing = np.zeros(3)
    return [
        {
            "x": position,
            "x_dot": velocity,
            "x_ddot": acceleration,
            "x_dddot": nothing,
            "x_ddddot": nothing,
            "yaw": 0.0,
            "yaw_dot": 0.0,
            "yaw_ddot": 0.0,
        }
        for position, velocity, acceleration in zip(
            motion.position_m, motion.velocity_m_s, motion.acceleration_m_s2, strict=True
        )
    ]


# --- what is told ---


def _spread(values: list[float]) -> dict[str, float]:
    return {"median": median(values), "least": min(values), "most": max(values)}


def _flight_figures(
    autopilot: str, kind: str, flown: list[Flown], shares: dict[str, float]
) -> dict[str, Any]:
    cost_ms = median(1e3 * flight.processor_s / flight.simulated_s for flight in flown)
    return {
        "autopilot": autopilot,
        "equations": kind,
        "simulated_s": flown[0].simulated_s,
        "times_real_time": _spread([flight.speed for flight in flown]),
        "times_real_time_by_wall": _spread([f.simulated_s / f.wall_s for f in flown]),
        "goal": GOALS[kind],
        "processor_ms_per_s": cost_ms,
        "share": shares,
        "ms_per_s": {part: share * cost_ms for part, share in shares.items()},
    }


def _lines(figures: dict[str, Any]) -> list[str]:
    lines = [
        (
            f"trajectory {figures['trajectory']}, boot to disarm, log written, one process; "
            f"{figures['repeats']} rounds; median (least ... most), by processor time"
        )
    ]
    for flight in figures["flights"]:
        speed = flight["times_real_time"]
        lines.append(
            f"{flight['autopilot']:10} {flight['equations']:9} {speed['median']:5.1f} × real time "
            f"({speed['least']:.1f} ... {speed['most']:.1f}; goal {flight['goal']:.0f}), "
            f"{flight['processor_ms_per_s']:.1f} ms per simulated second:"
        )
        lines += [
            f"    {part:28} {cost:5.1f} ms  {flight['share'][part]:4.0%}"
            for part, cost in flight["ms_per_s"].items()
        ]
    lines.append(f"steps of {figures['step_ms']:.0f} ms per second, of a simulation alone:")
    for name, rate in figures["steps_per_s"].items():
        lines.append(
            f"{name:22} {rate['median']:8.0f} ({rate['least']:.0f} ... {rate['most']:.0f}), "
            f"{rate['median'] * STEP_S:.0f} × real time"
        )
    lines += [f"{name}: {says}" for name, says in figures["what_each_does"].items()]
    if "left_out" in figures:
        lines.append(f"left out: {figures['left_out']}")
    return lines


if __name__ == "__main__":
    main("lockstep", "Speed of whole simulated flights, and of simulations alone.", run, options)
