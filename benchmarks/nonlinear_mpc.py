"""Times the linear MPC against a nonlinear one of the same task, horizon and rate.

    OMP_NUM_THREADS=1 python benchmarks/nonlinear_mpc.py [--ticks 667] [--seed 1] [--json]

Needs CasADi: ``pip install 'companion[nonlinear]'``.  What is compared with what, and what the
comparison can't show, is said in `companion/experiments/computing_time.py`.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from companion.experiments.computing_time import (
    WHOLE_TRAJECTORY,
    ComputingTime,
    measure_computing_time,
)
from companion.experiments.flight_store import MissingExtraError


def machine() -> dict[str, Any]:
    """On what the figures were measured."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": models[0] if models else platform.processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "blas_threads": os.environ.get("OMP_NUM_THREADS", ""),
    }


def commit() -> str:
    """The checkout's commit, with a plus if files differ from it; empty if there is none."""
    said = subprocess.run(
        ["git", "describe", "--always", "--abbrev=12", "--dirty=+", "--exclude=*"],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        check=False,
    )
    return said.stdout.strip()


def table(result: ComputingTime) -> str:
    """The comparison as text."""

    def number(value: float | None, form: str, scale: float = 1.0) -> str:
        return "–" if value is None else format(scale * value, form)

    task = (
        f"trajectory {result.trajectory}, {result.ticks} plans ({result.flown_s:.1f} s), "
        f"N_h = {result.horizon}, {result.period_s * 1e3:.0f} ms, seed {result.seed}; "
        f"CasADi {result.casadi_version}, SQP over {result.quadratic_solver}"
    )
    head = (
        f"{'method':<16}{'plans':>6}{'median µs':>11}{'p99':>8}{'max':>8}{'ratio':>7}"
        f"{'iterations':>12}{'converged':>11}{'error mm':>10}"
    )
    rows = [
        f"{m.name:<16}{m.plans:>6}{number(m.median_us, '.0f'):>11}{number(m.p99_us, '.0f'):>8}"
        f"{number(m.max_us, '.0f'):>8}{number(m.ratio, '.1f'):>7}"
        f"{number(m.iterations, '.1f'):>12}{number(m.converged_share, '.1%'):>11}"
        f"{number(m.mean_error_m, '.1f', 1e3):>10}"
        for m in result.methods
    ]
    meanings = [f"{m.name:<16}{m.what}" for m in result.methods]
    return "\n".join([task, "", head, *rows, "", *meanings]) + "\n"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ticks", type=int, default=WHOLE_TRAJECTORY, help="plans per method")
    parser.add_argument("--seed", type=int, default=1, help="of the measurement noise")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    try:
        result = measure_computing_time(options.ticks, options.seed)
    except (MissingExtraError, ValueError) as error:
        sys.exit(str(error))
    if options.json:
        said = {"machine": machine(), "commit": commit()} | asdict(result)
        sys.stdout.write(json.dumps(said, indent=2, allow_nan=False, ensure_ascii=False) + "\n")
    else:
        sys.stdout.write(table(result))


if __name__ == "__main__":
    main()
