"""soak.json, and the verdicts as text."""

import json
import platform
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from companion.experiments.provenance import commit, version
from tools.soak.runs import Run
from tools.soak.trend import CONFIDENCE
from tools.soak.verdicts import LATENCY_MEANS, Fitted, unplanned_endings

Runs = Sequence[tuple[Run, list[Fitted]]]


def passed(runs: Runs) -> bool:
    """Every gauge keeps to its limit and every flight has landed."""
    return all(not unplanned_endings(run) and all(fit.passed for fit in fits) for run, fits in runs)


def report(runs: Runs) -> dict[str, Any]:
    """All that was found, and what it was found from."""
    return {
        "passed": passed(runs),
        "version": version(),
        "commit": commit(),
        "machine": f"{platform.machine()}, Python {platform.python_version()}",
        "method": "least squares through the means of blocks; one-sided limits by Student's t",
        "confidence": CONFIDENCE,
        "runs": [_run(run, fits) for run, fits in runs],
    }


def write(path: Path, runs: Runs) -> None:
    """Write it as JSON.

    Raises:
        OSError: the file cannot be written.
    """
    path.write_text(json.dumps(report(runs), allow_nan=False, indent=1) + "\n")


def lines(runs: Runs) -> list[str]:
    """A verdict in each line."""
    told = []
    for run, fits in runs:
        for fit in fits:
            gauge, trend = fit.gauge, fit.trend
            told.append(
                f"{fit.word:<10}{run.name:<12}{gauge.title:<14}{trend.slope_per_h:+10.4f} "
                f"{gauge.unit}/h, 95 % limit {trend.upper_per_h:+.4f}, may be {gauge.limit_per_h:g}"
                + ("" if fit.longer is None else f"; {fit.longer:.1f} times as long may tell")
            )
        endings = unplanned_endings(run)
        told.append(
            f"{'failed' if endings else 'passed':<10}{run.name:<12}{len(run.flights)} flights, "
            f"{_hours(run):.2f} h, {_missed(run)} missed deadlines"
        )
        told += endings
    return told


def _run(run: Run, fits: list[Fitted]) -> dict[str, Any]:
    return {
        "name": run.name,
        "hours": round(_hours(run), 4),
        "missed_deadlines": _missed(run),
        "latency_is": LATENCY_MEANS[run.name],
        "gauges": [
            {
                "gauge": fit.gauge.title,
                "unit": fit.gauge.unit,
                "verdict": fit.word,
                "slope_per_h": fit.trend.slope_per_h,
                "lower_95_per_h": fit.trend.lower_per_h,
                "upper_95_per_h": fit.trend.upper_per_h,
                "limit_per_h": fit.gauge.limit_per_h,
                "warm_up_h": fit.warm_up_h,
                "blocks": fit.trend.blocks,
                "level": fit.trend.middle,
            }
            for fit in fits
        ],
        **{name: values for name, values in asdict(run).items() if name != "name"},
    }


def _hours(run: Run) -> float:
    return float(sum(flight["flight_s"] for flight in run.flights)) / 3600.0


def _missed(run: Run) -> int:
    return int(sum(flight["missed_deadlines"] for flight in run.flights))
