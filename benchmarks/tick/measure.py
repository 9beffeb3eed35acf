"""From a recorded set and a horizon to the figures of every contender."""

import math
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from benchmarks.harness import quantiles
from benchmarks.tick.contenders import Contender
from benchmarks.tick.inputs import read_recording
from benchmarks.tick.problem import TickInput, constrained, make_problem, tick_inputs
from benchmarks.tick.race import Run, race
from benchmarks.tick.reference import Reference
from companion.control.reference_model import Array


def measure(
    name: str,
    horizon: int,
    contenders: Sequence[Contender],
    *,
    repeats: int,
) -> tuple[dict[str, Any], dict[str, str]]:
    """Race the contenders over a recorded set.

    Args:
        name: of the recording.
        horizon: N_h.
        contenders: to be timed.
        repeats: of each tick, of which the least counts.

    Returns:
        Figures (times in µs, errors of the first input in mm), and who was left out and why.
    """
    recording = read_recording(name)
    problem = make_problem(horizon, recording.r_max_m_s2)
    ticks = tick_inputs(recording, horizon)
    share = float(np.mean([constrained(problem, tick).any() for tick in ticks]))
    exact = _exact(Reference(problem), ticks)
    runs, left_out = race(contenders, problem, ticks, repeats=repeats)
    found = {
        "horizon": horizon,
        "ticks": len(ticks),
        "r_max_m_s2": recording.r_max_m_s2,
        "constrained_share": round(share, 4),
        "contenders": {
            c.name: _says(c) | _figures(runs[c.name], exact) for c in contenders if c.name in runs
        },
    }
    return found, left_out


def exponent(horizons: Sequence[int], times_us: Sequence[float]) -> float:
    """Of the power of N_h that fits the times best, by least squares of the logarithms."""
    return float(np.polyfit(np.log(horizons), np.log(times_us), 1)[0])


def _exact(reference: Reference, ticks: Sequence[TickInput]) -> Array:
    return np.array([reference.first_input(tick) for tick in ticks])


def _says(contender: Contender) -> dict[str, Any]:
    said = {"kind": contender.kind, "settings": contender.settings}
    try:
        installed = version(contender.library) if contender.library else ""
    except PackageNotFoundError:
        installed = ""
    return said | {"library": f"{contender.library} {installed}".strip()}


def _figures(run: Run, exact: Array) -> dict[str, float]:
    told = quantiles(run.time_us.tolist())
    error_mm = 1e3 * np.abs(run.first_m - exact).max(axis=2)
    ran = error_mm[~np.isnan(error_mm).all(axis=1)]
    worst = float(ran.max())
    return {
        "median_us": round(told["p50"], 2),
        "p99_us": round(told["p99"], 2),
        "max_us": round(told["max"], 2),
        "worst_error_mm": _digits(worst),
    }


def _digits(value: float, digits: int = 2) -> float:
    """A value to so many digits; what is no number is an error beyond all."""
    if not math.isfinite(value):
        return 1e9
    return float(f"{value:.{digits}g}")
