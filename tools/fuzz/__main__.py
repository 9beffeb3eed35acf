"""``python -m tools.fuzz TARGET``: fuzz one target, by seeds; see docs/fuzzing.md."""

import argparse
import json
import sys
import time
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from pathlib import Path

from tools.fuzz.target import Target
from tools.fuzz.targets import STRETCH, TARGETS
from tools.fuzz.work import Done, Task, begin, run_one, work

_TOLD_EVERY_S = 10.0

_target: Target | None = None
"""Of a worker process, made once at its beginning."""


def main() -> int:
    """Fuzz; 1 if there was a finding."""
    arguments = _arguments()
    if arguments.repeat is not None:
        return _repeat(arguments.target, arguments.repeat)
    if arguments.guided:
        from tools.fuzz.guided import run_guided

        return run_guided(
            arguments.target,
            arguments.corpus or Path("out") / "fuzz" / arguments.target / "corpus",
            arguments.out,
            runs=arguments.runs,
            seconds=arguments.seconds,
            seed=arguments.seed,
        )
    arguments.out.mkdir(parents=True, exist_ok=True)
    done, wall_s = _fuzz(arguments)
    rate = done.units / max(1e-9, wall_s)
    summary = {
        "target": arguments.target,
        "seed": arguments.seed,
        "jobs": arguments.jobs,
        "units": done.units,
        "inputs": done.inputs,
        "wall_s": round(wall_s, 1),
        "cpu_s": round(done.cpu_s, 1),
        "units_per_s": round(rate, 1),
        "slowest_input_s": round(done.slowest_s, 3),
        "findings": done.findings,
    }
    path = arguments.out / f"{arguments.target}.json"
    path.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    print(f"{arguments.target}: {done.units} units in {wall_s:.0f} s ({rate:.0f}/s), "
          f"{len(done.findings)} findings; {path}")  # fmt: skip
    for sign, file in sorted(done.findings.items()):
        print(f"  {sign}\n    {file}")
    return 1 if done.findings else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz", description=__doc__)
    parser.add_argument("target", choices=sorted(TARGETS))
    parser.add_argument("--runs", type=int, help="packets or documents (default: 100,000)")
    parser.add_argument("--seconds", type=float, help="end after so long, if not before")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--corpus", type=Path, help="inputs to vary; --guided adds to them")
    parser.add_argument("--out", type=Path, default=Path("out") / "fuzz")
    parser.add_argument("--guided", action="store_true", help="by coverage, with atheris")
    parser.add_argument("--repeat", type=Path, metavar="FILE", help="run the input of a finding")
    return parser.parse_args()


def _fuzz(arguments: argparse.Namespace) -> tuple[Done, float]:
    """Hand out stretches of work until there is enough."""
    runs = arguments.runs
    if runs is None:
        runs = 100_000 if arguments.seconds is None else 1 << 62
    began_s = told_s = time.monotonic()
    total = Done()
    handed_out = number = 0
    running: set[Future[Done]] = set()
    stretch = STRETCH[arguments.target]
    with ProcessPoolExecutor(
        arguments.jobs, initializer=_prepare, initargs=(arguments.target,)
    ) as pool:
        while True:
            late = arguments.seconds is not None and time.monotonic() - began_s > arguments.seconds
            while len(running) < arguments.jobs and handed_out < runs and not late:
                units = min(stretch, runs - handed_out)
                task = Task(
                    arguments.target,
                    arguments.seed * 1_000_003 + number,
                    units,
                    arguments.out,
                    arguments.corpus,
                )
                running.add(pool.submit(_in_worker, task))
                handed_out += units
                number += 1
            if not running:
                break
            over, running = wait(running, timeout=_TOLD_EVERY_S, return_when=FIRST_COMPLETED)
            for future in over:
                _add(total, future.result())
            if time.monotonic() - told_s >= _TOLD_EVERY_S:
                told_s = time.monotonic()
                _tell(total, runs, told_s - began_s, arguments.seconds)
    return total, time.monotonic() - began_s


def _add(total: Done, done: Done) -> None:
    total.units += done.units
    total.inputs += done.inputs
    total.cpu_s += done.cpu_s
    total.slowest_s = max(total.slowest_s, done.slowest_s)
    for sign, file in done.findings.items():
        if sign not in total.findings:
            print(f"finding: {sign}\n  {file}", flush=True)
        total.findings.setdefault(sign, file)


def _tell(total: Done, runs: int, spent_s: float, seconds: float | None) -> None:
    rate = total.units / spent_s
    left_s = (runs - total.units) / rate if rate > 0.0 else float("inf")
    left_s = min(left_s, (seconds or float("inf")) - spent_s)
    print(
        f"{total.units} units, {rate:.0f}/s, {len(total.findings)} findings, "
        f"{max(0.0, left_s) / 60.0:.1f} min left",
        flush=True,
    )


def _prepare(target: str) -> None:
    global _target  # noqa: PLW0603 - what a process is initialised with has nowhere else to stay
    _target = begin(target)


def _in_worker(task: Task) -> Done:
    assert _target is not None
    return work(task, _target)


def _repeat(name: str, path: Path) -> int:
    target = begin(name)
    run_one(target, path.read_bytes())
    print("nothing happened")
    return 0


if __name__ == "__main__":
    sys.exit(main())
