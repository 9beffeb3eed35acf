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
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from types import FrameType
from typing import Any

from benchmarks.harness import Report, main
from benchmarks.stepping.simulations import STEP_S, compiling, steppers
from companion.config.resolve import load_flight
from companion.flight.assemble import make_trajectory
from companion.flight.beginning import begin_log, shim_options
from companion.flight.observer import SilentObserver
from companion.flight.records import CHANNELS
from companion.lockstep import fly_in_lockstep

AUTOPILOTS = ("px4", "ardupilot")
GOALS = {"compiled": 40.0, "plain": 15.0}
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
    alone = steppers(kinds, asked.trajectory)
    flights: dict[tuple[str, str], list[Flown]] = {}
    steps: dict[str, list[float]] = {name: [] for name in alone}
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
        for name, stepper in alone.items():
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
    with tempfile.TemporaryDirectory() as made, compiling(kind):
        config = load_flight(None, {"trajectory": trajectory, "autopilot": autopilot}, {})
        shim = shim_options(config, lockstep=True)
        if shim is None:
            raise ValueError("the flight needs the embedded shim")
        course = make_trajectory(config.mission)
        log = begin_log(Path(made), CHANNELS, lockstep=True)
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
