"""Flies the shipped controller on vehicles that are not the one it was made for.

    python benchmarks/robustness.py [--vehicle bebop2] [--controller mpc-l1] [--seeds 1] [--json]

Each row perturbs the simulated vehicle; the figures are mean tracking errors against the
truth on trajectories 2, 4 and 5, calm, in lockstep, and their mean as a ratio to the nominal one.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from companion.config.resolve import find_config, load_flight
from companion.flight.assemble import make_trajectory
from companion.flight.observer import SilentObserver
from companion.flight.records import CHANNELS
from companion.flight.shim_process import ShimOptions
from companion.lockstep import fly_in_lockstep
from companion.recording.flight_log import FlightLog
from companion.report.flight_data import read_flight
from companion.report.metrics import tracking_figures

VEHICLES = Path(__file__).parent.parent / "sitl_shim" / "plant" / "vehicles"
TRAJECTORIES = (2, 4, 5)

Change = Callable[[dict[str, Any]], None]


def scaled(*path: str, by: float) -> Change:
    """Scale a number of the vehicle's file."""

    def change(vehicle: dict[str, Any]) -> None:
        *parents, last = path
        for parent in parents:
            vehicle = vehicle[parent]
        vehicle[last] *= by

    return change


def attitude_gain(by: float) -> list[Change]:
    """Scale the attitude loop's gains, on which its lag depends inversely."""
    return [scaled("autopilot_parameters", f"MC_{axis}_P", by=by) for axis in ("ROLL", "PITCH")]


def delayed(seconds: float) -> list[Change]:
    """Add a delay, half on the telemetry and half on the command."""

    def change(vehicle: dict[str, Any]) -> None:
        vehicle["telemetry_delay_s"] += seconds / 2
        vehicle["command_delay_s"] += seconds / 2

    return [change]


PERTURBATIONS: dict[str, list[Change]] = {
    "nominal": [],
    "attitude lag +25 %": attitude_gain(1 / 1.25),
    "attitude lag -25 %": attitude_gain(1 / 0.75),
    "mass +20 %": [scaled("mass_kg", by=1.2)],
    "mass -20 %": [scaled("mass_kg", by=0.8)],
    "thrust +15 %": [scaled("propulsion", "max_thrust_n", by=1.15)],
    "thrust -15 %": [scaled("propulsion", "max_thrust_n", by=0.85)],
    "delay +20 ms": delayed(0.020),
}


def mean_error_mm(trajectory: int, seed: int, vehicle: str, controller: str, shim: Path) -> float:
    """Fly once; mean error against the truth, mm; infinite if the flight did not land."""
    config = load_flight(
        None,
        {"trajectory": trajectory, "seed": seed, "vehicle": vehicle, "controller": controller},
        {},
    )
    with tempfile.TemporaryDirectory() as folder:
        log = FlightLog(Path(folder), CHANNELS)
        try:
            outcome = fly_in_lockstep(
                config,
                make_trajectory(config.mission),
                log,
                SilentObserver(),
                ShimOptions("px4", str(shim), find_config("scenario", "calm"), seed),
            )
        finally:
            log.close()
        if outcome.outcome != "landed" or outcome.scored_s is None:
            return float("inf")
        figures = tracking_figures(read_flight(Path(folder)), outcome.scored_s).against_truth
        return float("inf") if figures is None else figures.mean_m * 1e3


def main() -> None:
    """Fly all rows and print them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--vehicle", default="bebop2")
    parser.add_argument("--controller", default="mpc-l1")
    parser.add_argument("--seeds", type=int, default=1, help="flights per trajectory")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    original = yaml.safe_load((VEHICLES / f"{options.vehicle}.yaml").read_text())
    rows: dict[str, dict[str, Any]] = {}
    for name, changes in PERTURBATIONS.items():
        vehicle = json.loads(json.dumps(original))
        for change in changes:
            change(vehicle)
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            yaml.safe_dump(vehicle, file)
            file.flush()
            errors = {
                number: float(
                    np.mean(
                        [
                            mean_error_mm(
                                number, seed, options.vehicle, options.controller, Path(file.name)
                            )
                            for seed in range(1, options.seeds + 1)
                        ]
                    )
                )
                for number in TRAJECTORIES
            }
        mean = float(np.mean(list(errors.values())))
        rows[name] = {"mean_error_mm": errors, "mean_mm": mean}
        rows[name]["ratio"] = mean / rows["nominal"]["mean_mm"]
        if not options.json:
            figures = "  ".join(f"{errors[number]:7.1f}" for number in TRAJECTORIES)
            sys.stdout.write(
                f"{name:<20} {figures}   mean {mean:7.1f} mm, {rows[name]['ratio']:.2f} ×\n"
            )
            sys.stdout.flush()
    if options.json:
        sys.stdout.write(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
