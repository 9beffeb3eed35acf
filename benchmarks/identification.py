"""Flies identification flights of shipped vehicles, and holds what is found against the truth.

    python benchmarks/identification.py [--vehicles bebop2,x500,sih_quadx]
        [--flavours px4,ardupilot] [--seeds 20] [--jobs 2] [--out DIR] [--json FILE]

Each seed is flown twice in lockstep: with the vehicle's own sensors, which `identify` is given, and
with exact ones.  The truth of a figure is what the very same fit, weighted the same, makes of the
exact flight.  A flight's figures are kept in the folder as they come, so a stopped study goes on.
"""

import argparse
import json
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from companion.experiments.identification_flight import fly_identification
from companion.experiments.workers import Failure, Workers, default_jobs
from companion.identification.estimates import Estimate, Identified, Response, UnidentifiedError
from companion.identification.identify import identify_weighted

VEHICLES = ("bebop2", "x500", "sih_quadx")
FLAVOURS = ("px4", "ardupilot")
_DEAD_TIME_S = 0.010
_SHARE, _HOVER_SHARE = 0.10, 0.02
_RESPONSES = ("roll", "pitch", "lift", "climb")


@dataclass(frozen=True, slots=True)
class Flight:
    """One of the study."""

    vehicle: str
    flavour: str
    seed: int
    folder: Path

    @property
    def file(self) -> Path:
        """Where its figures are kept."""
        return self.folder / f"{self.vehicle}-{self.flavour}-{self.seed}.json"


@dataclass(frozen=True, slots=True)
class Row:
    """A figure of one vehicle under one flavour, over the seeds."""

    vehicle: str
    flavour: str
    figure: str
    seeds: int
    truth: float
    """Mean."""
    error_rms: float
    error_max: float
    half_width: float
    """Median."""
    covered: float
    """Share of the intervals with the truth in them."""
    tolerance: float | None
    """What the error must stay within; None: nothing was promised."""
    within: float | None
    """Share of the errors that do."""


def figures(identified: Identified) -> Iterator[tuple[str, Estimate]]:
    """Every figure that has a truth in an exact flight, by name."""
    for name in _RESPONSES:
        response: Response | None = getattr(identified, name)
        if response is not None:
            yield f"{name} ωn", response.natural_frequency_rad_s
            yield f"{name} ζ", response.damping
            yield f"{name} dead time", response.dead_time_s
            yield f"{name} gain", response.gain
    yield "tilt gain", identified.tilt_gain
    yield "k1", identified.linear_drag_1_s
    yield "k2", identified.quadratic_drag_1_m
    if identified.hover_thrust is not None:
        yield "hover thrust", identified.hover_thrust


def tolerance(figure: str, truth: float) -> float | None:
    """What the error of a figure may be."""
    if figure.endswith("dead time"):
        return _DEAD_TIME_S
    if figure == "hover thrust":
        return _HOVER_SHARE * abs(truth)
    if figure.endswith(("ωn", "gain")):
        return _SHARE * abs(truth)
    return None


def fly(flight: Flight) -> str:
    """Fly both, identify both, keep the figures; gives how the flight ended."""
    said: dict[str, Any] = {"vehicle": flight.vehicle, "flavour": flight.flavour}
    said["seed"] = flight.seed
    outcome, kept = fly_identification(flight.vehicle, autopilot=flight.flavour, seed=flight.seed)
    said["outcome"], said["airborne_s"] = outcome.outcome, outcome.flight_s
    try:
        found, weighting = identify_weighted(kept.recording())
        _, exact = fly_identification(
            flight.vehicle, autopilot=flight.flavour, seed=flight.seed, sensors="exact"
        )
        truth, _ = identify_weighted(exact.recording(), weighting=weighting)
    except UnidentifiedError as error:
        said["unidentified"] = str(error)
    else:
        true = dict(figures(truth))
        said["figures"] = {
            name: [estimate.value, estimate.half_width_95, true[name].value]
            for name, estimate in figures(found)
        }
    unfinished = flight.file.with_suffix(".part")
    unfinished.write_text(json.dumps(said, ensure_ascii=False))
    unfinished.replace(flight.file)
    return outcome.outcome


def rows_of(flights: list[dict[str, Any]]) -> list[Row]:
    """One row for each figure of each vehicle and flavour."""
    rows = []
    for vehicle, flavour in dict.fromkeys((f["vehicle"], f["flavour"]) for f in flights):
        own = [
            f["figures"]
            for f in flights
            if (f["vehicle"], f["flavour"]) == (vehicle, flavour) and "figures" in f
        ]
        for name in dict.fromkeys(name for flight in own for name in flight):
            value, width, truth = np.array([flight[name] for flight in own]).T
            error = np.abs(value - truth)
            limits = [tolerance(name, true) for true in truth]
            limit = limits[0] and float(np.mean([x for x in limits if x is not None]))
            rows.append(
                Row(
                    vehicle,
                    flavour,
                    name,
                    len(own),
                    float(truth.mean()),
                    float(np.sqrt(np.mean(error**2))),
                    float(error.max()),
                    float(np.median(width)),
                    float(np.mean(error <= width)),
                    limit,
                    None if limit is None else float(np.mean(error <= limit)),
                )
            )
    return rows


def summary(flights: list[dict[str, Any]]) -> dict[str, Any]:
    """Over everything: coverage, and half-widths and errors in units of the tolerances."""
    covered, widths, errors = [], [], []
    for flight in flights:
        for name, (value, width, truth) in flight.get("figures", {}).items():
            covered.append(abs(value - truth) <= width)
            limit = tolerance(name, truth)
            if limit:
                widths.append(width / limit)
                errors.append(abs(value - truth) / limit)
    nothing = math.nan
    return {
        "flights": len(flights),
        "unidentified": sum("figures" not in flight for flight in flights),
        "intervals": len(covered),
        "coverage": float(np.mean(covered)) if covered else nothing,
        "median_half_width_over_tolerance": float(np.median(widths)) if widths else nothing,
        "within_tolerance": float(np.mean(np.array(errors) <= 1.0)) if errors else nothing,
        "longest_airborne_s": max((flight["airborne_s"] or 0.0 for flight in flights), default=0.0),
    }


def table(rows: list[Row], whole: dict[str, Any]) -> str:
    """As text."""
    head = (
        f"{'vehicle':<11}{'flavour':<11}{'figure':<17}{'truth':>9}{'error rms':>11}{'max':>9}"
        f"{'half-width':>12}{'tolerance':>11}{'within':>8}{'covered':>9}"
    )
    lines = [head]
    for row in rows:
        limit = "–" if row.tolerance is None else f"{row.tolerance:.4f}"
        within = "–" if row.within is None else f"{row.within:.0%}"
        lines.append(
            f"{row.vehicle:<11}{row.flavour:<11}{row.figure:<17}{row.truth:>9.4f}"
            f"{row.error_rms:>11.4f}{row.error_max:>9.4f}{row.half_width:>12.4f}"
            f"{limit:>11}{within:>8}{row.covered:>9.0%}"
        )
    lines.append("")
    lines.append(
        f"{whole['flights']} flights ({whole['unidentified']} not identified), "
        f"{whole['intervals']} intervals: {whole['coverage']:.1%} cover the truth; median "
        f"half-width {whole['median_half_width_over_tolerance']:.2f} of the tolerance; "
        f"{whole['within_tolerance']:.1%} of the errors within it; "
        f"at most {whole['longest_airborne_s']:.0f} s in the air"
    )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Fly what is missing, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--vehicles", default=",".join(VEHICLES))
    parser.add_argument("--flavours", default=",".join(FLAVOURS))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=default_jobs())
    parser.add_argument("--out", type=Path, default=Path("identification-study"))
    parser.add_argument("--json", type=Path, help="write rows and summary there")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    study = [
        Flight(vehicle, flavour, seed, options.out)
        for seed in range(1, options.seeds + 1)
        for vehicle in options.vehicles.split(",")
        for flavour in options.flavours.split(",")
    ]
    missing = [flight for flight in study if not flight.file.exists()]

    def on_done(index: int, result: str | Failure) -> None:
        flight = missing[index]
        said = f": {result.reason if isinstance(result, Failure) else result}"
        sys.stderr.write(f"{flight.vehicle} {flight.flavour} seed {flight.seed}{said}\n")

    with Workers(fly, options.jobs) as workers:
        workers.run(missing, on_done)
    flights = [json.loads(f.file.read_text()) for f in study if f.file.exists()]
    rows, whole = rows_of(flights), summary(flights)
    sys.stdout.write(table(rows, whole))
    for flight in flights:
        if "unidentified" in flight:
            name = f"{flight['vehicle']} {flight['flavour']} seed {flight['seed']}"
            sys.stdout.write(f"{name}: {flight['unidentified']}\n")
    if options.json is not None:
        said = {"summary": whole, "rows": [_plain(row) for row in rows]}
        options.json.write_text(json.dumps(said, indent=2, ensure_ascii=False) + "\n")


def _plain(row: Row) -> dict[str, Any]:
    return {name: getattr(row, name) for name in Row.__slots__}


if __name__ == "__main__":
    main()
