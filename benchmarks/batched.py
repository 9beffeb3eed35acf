"""The batched study against single flights: the same points both ways, its speed, and a map.

    python benchmarks/batched.py [--points 30] [--vehicles 1000] [--map FILE.png] [--json] [--keep]

Points are drawn evenly: two thirds of them over what campaigns vary, a third well beyond, where
vehicles come to grief.  Speed is processor time, of one core, in the same run.
"""

import argparse
import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from harness import Report, main

from companion.experiments.batched.flying import fly_batch_told
from companion.experiments.batched.task import BatchTask
from companion.experiments.campaigns.parameters import plant_changes
from companion.experiments.flight_store import Summary
from companion.experiments.flight_task import FlightTask
from companion.experiments.fly_task import fly_task
from companion.experiments.perturbed_plant import write_plant

CONTROLLER = "mpc-l1"
TRAJECTORIES = (2, 4, 5)
WINDS = ("calm", "fan")
USUAL = {
    "plant.mass": (0.8, 1.2),
    "plant.thrust": (0.85, 1.15),
    "plant.attitude_lag": (0.75, 1.5),
    "plant.delay_s": (0.0, 0.04),
    "plant.drag": (0.5, 2.0),
}
BEYOND = USUAL | {"plant.attitude_lag": (1.5, 3.0), "plant.delay_s": (0.03, 0.065)}
SECONDS = 24.0
"""Flown by each vehicle: a hover of 4 s, and 20 s that are scored."""
_LEGIBLE_M = (0.015, 0.5)


def run(options: argparse.Namespace) -> Report:
    """Fly both ways, then many at once."""
    nominal = [BatchTask(FlightTask(CONTROLLER, t, w)) for t in TRAJECTORIES for w in WINDS]
    points = _points(options.points)
    singles, single_s = _fly_singly(nominal + points)
    batched = fly_batch_told(nominal + points).rows
    count = len(nominal)
    flown_s = sum(SECONDS if math.isfinite(one) else 0.0 for one in singles)
    figures: dict[str, Any] = {"points": len(points)}
    figures |= _agreement(nominal + points, singles, batched, count)
    begin = time.process_time()
    many = fly_batch_told([_drawn(seed, USUAL) for seed in range(options.vehicles)])
    batch_s = time.process_time() - begin
    done_s = sum(row.flown_s + SECONDS - row.scored_s for row in many.rows)
    speed = {
        "single": flown_s / single_s,
        "batched": done_s / batch_s,
        "vehicles": len(many.rows),
        "constrained_share": float(np.mean(many.constrained_share)),
    }
    figures["vehicle_seconds_per_second"] = speed
    figures["speed_ratio"] = speed["batched"] / speed["single"]
    if options.map is not None:
        figures["map"] = _map(options.map)
    return figures, _lines(figures)


def _drawn(seed: int, ranges: dict[str, tuple[float, float]]) -> BatchTask:
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(22,)))
    trajectory = TRAJECTORIES[rng.integers(len(TRAJECTORIES))]
    wind = WINDS[rng.integers(len(WINDS))]
    plant = tuple((name, float(rng.uniform(*ends))) for name, ends in ranges.items())
    return BatchTask(FlightTask(CONTROLLER, int(trajectory), wind, seed=seed), plant)


def _points(count: int) -> list[BatchTask]:
    return [_drawn(seed, BEYOND if seed % 3 == 0 else USUAL) for seed in range(1, count + 1)]


def _fly_singly(tasks: list[BatchTask]) -> tuple[list[float], float]:
    """Mean errors, and the processor time of the flights that were flown to their end."""
    errors, taken_s = [], 0.0
    with tempfile.TemporaryDirectory() as folder:
        for k, task in enumerate(tasks):
            flight = task.flight
            changes = plant_changes(dict(task.plant))
            path = write_plant(flight.vehicle, changes, Path(folder) / f"{k}.yaml")
            single = FlightTask(
                flight.controller, flight.trajectory, flight.wind, flight.seed,
                shim_vehicle=str(path),
            )  # fmt: skip
            begin = time.process_time()
            error = fly_task(single).mean_error_m
            taken_s += time.process_time() - begin if math.isfinite(error) else 0.0
            errors.append(error)
    return errors, taken_s


def _agreement(
    tasks: list[BatchTask], singles: list[float], rows: list[Summary], nominal: int
) -> dict[str, Any]:
    """How alike the errors are; vehicles that were lost count by themselves."""
    flown = np.array(singles)
    batch = np.array([row.mean_error_m for row in rows])
    kinds = [(task.flight.trajectory, task.flight.wind) for task in tasks]
    norms = {kind: (flown[k], batch[k]) for k, kind in enumerate(kinds[:nominal])}
    both = np.isfinite(flown) & np.isfinite(batch)
    ratios = (batch / np.where(both, flown, 1.0))[both]
    worse = np.array([(flown[k] / norms[kind][0], batch[k] / norms[kind][1])
                      for k, kind in enumerate(kinds) if both[k] and k >= nominal])  # fmt: skip
    lost = np.isinf(flown[nominal:]), np.isinf(batch[nominal:])
    return {
        "compared": int(both.sum()),
        "median_ratio": float(np.median(ratios)),
        "ratio_p10": float(np.quantile(ratios, 0.1)),
        "ratio_p90": float(np.quantile(ratios, 0.9)),
        "worst_ratio": float(ratios[np.argmax(np.abs(np.log(ratios)))]),
        "rank_correlation": _rank_correlation(flown[both], batch[both]),
        "rank_correlation_over_nominal": _rank_correlation(*worse.T),
        "lost": {
            "both": int((lost[0] & lost[1]).sum()),
            "flight_alone": int((lost[0] & ~lost[1]).sum()),
            "batched_alone": int((~lost[0] & lost[1]).sum()),
            "none": int((~lost[0] & ~lost[1]).sum()),
        },
        "rows": [
            {
                "trajectory": task.flight.trajectory,
                "wind": task.flight.wind,
                **{name: round(value, 4) for name, value in task.plant},
                "flight_mm": _mm(one),
                "batched_mm": _mm(row.mean_error_m),
            }
            for task, one, row in zip(tasks, singles, rows, strict=True)
        ],
    }


def _rank_correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Spearman's, of values without ties."""
    ranks = [np.argsort(np.argsort(values)) for values in (a, b)]
    return float(np.corrcoef(*ranks)[0, 1])


def _mm(metres: float) -> float | None:
    return round(1e3 * metres, 2) if math.isfinite(metres) else None


def _map(path: Path) -> dict[str, Any]:
    """Fly a grid of attitude lags and delays, two seeds each, and draw it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

    lags, delays = np.linspace(0.5, 2.5, 41), np.linspace(0.0, 0.065, 27)
    tasks = [
        BatchTask(
            FlightTask(CONTROLLER, 4, "calm", seed=seed),
            (("plant.attitude_lag", float(lag)), ("plant.delay_s", float(delay))),
        )
        for delay in delays for lag in lags for seed in (1, 2)
    ]  # fmt: skip
    begin = time.process_time()
    rows = fly_batch_told(tasks).rows
    taken_s = time.process_time() - begin
    errors = np.array([row.mean_error_m for row in rows]).reshape(len(delays), len(lags), 2)
    worst = errors.max(axis=2)
    figure = Figure(figsize=(7.2, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_facecolor("0.25")
    drawn = axes.pcolormesh(
        lags, 1e3 * delays, np.ma.masked_invalid(1e3 * worst), cmap="viridis",
        norm=LogNorm(*(1e3 * end for end in _LEGIBLE_M)), shading="nearest",
    )  # fmt: skip
    axes.plot(1.0, 0.0, "w+", markersize=12, clip_on=False)
    axes.set_xlabel("attitude lag, times the bebop2's (+)")
    axes.set_ylabel("further delay, ms")
    axes.set_title(f"{CONTROLLER}, trajectory 4, calm: {len(tasks)} vehicles (dark grey: lost)")
    figure.colorbar(drawn, label="mean error, mm (worse of two seeds)")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata={"Software": None} if path.suffix == ".png" else None)
    return {
        "vehicles": len(tasks),
        "seconds": taken_s,
        "lost_share": float(np.mean(~np.isfinite(errors))),
    }


def _lines(figures: dict[str, Any]) -> list[str]:
    lost, speed = figures["lost"], figures["vehicle_seconds_per_second"]
    single, batched, ratio = speed["single"], speed["batched"], figures["speed_ratio"]
    solved = 100 * speed["constrained_share"]
    apart = [f"{figures[name]:.3f}" for name in ("median_ratio", "ratio_p10", "ratio_p90")]
    over = figures["rank_correlation_over_nominal"]
    lines = [
        f"{figures['points']} points and the nominal ones; {figures['compared']} flown both ways",
        f"batched over single error: median {apart[0]}, 10 … 90 % {apart[1]} … {apart[2]}",
        f"worst {figures['worst_ratio']:.3f}",
        f"rank correlation {figures['rank_correlation']:.3f}; over the nominal's error {over:.3f}",
        f"lost: both {lost['both']}, the single alone {lost['flight_alone']}",
        f"lost: the batched alone {lost['batched_alone']}, neither {lost['none']}",
        f"vehicle-seconds per second of processor: single {single:.1f}, batched {batched:.0f}",
        f"{ratio:.0f} times, of {speed['vehicles']} vehicles; {solved:.1f} % of plans by a solver",
    ]
    for row in figures["rows"]:
        lines.append("  " + ", ".join(f"{name} {value}" for name, value in row.items()))
    if "map" in figures:
        said = figures["map"]
        lines.append(
            f"map: {said['vehicles']} vehicles in {said['seconds']:.1f} s of processor, "
            f"{100 * said['lost_share']:.0f} % lost"
        )
    return lines


def _options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--points", type=int, default=30, help="flown both ways")
    parser.add_argument("--vehicles", type=int, default=1000, help="at once, for the speed")
    parser.add_argument("--map", type=Path, help="draw a map of lag and delay to this file")


if __name__ == "__main__":
    main("batched", "The batched study against single flights.", run, _options)
