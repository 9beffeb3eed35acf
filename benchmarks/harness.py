"""What every benchmark says beside its figures: machine, commit, noise; and how it is written.

A benchmark is a script with one `run`: it gives a JSON object and the lines that a person reads.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
RESULTS = Path(__file__).resolve().parent / "results"
_LIBRARIES = ("numpy", "osqp", "daqp", "numba", "pymavlink")

Report = tuple[dict[str, Any], list[str]]
"""Figures as JSON, and the lines for a person."""


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    return {
        "processor": _processor(),
        "processors": len(os.sched_getaffinity(0)),
        "load_before": round(os.getloadavg()[0], 2),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "libraries": {name: found for name in _LIBRARIES if (found := _version(name))},
    }


def commit() -> str:
    """The commit that is measured, with a + if the checkout differs from it."""
    said = _git("rev-parse", "--short", "HEAD")
    return said + ("+" if said and _git("status", "--porcelain", "-uno") else "")


def timer_noise_ms(seconds: float = 5.0, period_s: float = 0.01) -> dict[str, float]:
    """How late this machine wakes a process that sleeps to deadlines, and does nothing else, ms."""
    late, begin = [], time.monotonic()
    for k in range(1, max(2, round(seconds / period_s)) + 1):
        due = begin + k * period_s
        time.sleep(max(0.0, due - time.monotonic()))
        late.append(1e3 * (time.monotonic() - due))
    return quantiles(late)


def work_noise(repeats: int = 2000) -> dict[str, float]:
    """How much the time of the same 50 µs of work spreads, over its median."""
    taken = []
    for _ in range(repeats):
        begin = time.perf_counter()
        sum(range(2500))
        taken.append(time.perf_counter() - begin)
    found = quantiles(taken)
    return {name: value / found["p50"] for name, value in found.items()}


def quantiles(values: Sequence[float]) -> dict[str, float]:
    """Median, 99th percentile and greatest of some figures."""
    ordered = sorted(values)
    last = len(ordered) - 1
    return {
        "p50": ordered[last // 2],
        "p99": ordered[round(0.99 * last)],
        "max": ordered[-1],
    }


def main(
    name: str,
    says: str,
    run: Callable[[argparse.Namespace], Report],
    options: Callable[[argparse.ArgumentParser], None] | None = None,
) -> None:
    """Parse, run, tell, and keep the result in ``benchmarks/results/NAME.json`` with ``--keep``.

    Args:
        name: of the benchmark.
        says: what it measures, for ``--help``.
        run: the benchmark.
        options: adds its own options.
    """
    parser = argparse.ArgumentParser(description=says)
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    parser.add_argument(
        "--keep", action="store_true", help=f"write it to benchmarks/results/{name}.json too"
    )
    if options is not None:
        options(parser)
    asked = parser.parse_args()
    head = {
        "benchmark": name,
        "date": datetime.now(UTC).date().isoformat(),
        "commit": commit(),
        "command": " ".join(["python", f"benchmarks/{name}.py", *sys.argv[1:]]),
        "machine": machine(),
    }
    figures, lines = run(asked)
    text = json.dumps(head | {"results": figures}, indent=2, ensure_ascii=False, allow_nan=False)
    if asked.keep:
        RESULTS.mkdir(exist_ok=True)
        (RESULTS / f"{name}.json").write_text(text + "\n", encoding="utf-8")
    print(text if asked.json else "\n".join(lines))


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def _git(*words: str) -> str:
    try:
        done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return done.stdout.strip()
