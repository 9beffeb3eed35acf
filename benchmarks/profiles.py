"""What takes a flight's time, at an earlier commit and now, in turns in one run.

    python benchmarks/profiles.py [--before cb6002a] [--rounds 2] [--json] [--keep]

Both are checkouts of their commits in folders that are thrown away; each flies `companion fly
--lockstep` in a process of its own, first to warm up and then under a sampling profiler, which asks
at each millisecond of processor time whose code runs.  What is measured is committed, or it isn't
measured.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout, suppress
from io import StringIO
from pathlib import Path
from statistics import median
from types import FrameType
from typing import Any

from benchmarks.harness import ROOT, Report, main, work_noise

_SAMPLE_S = 0.001
_FIRST = "cb6002a"
"""Before the work on speed began."""
_PARTS = (
    ("sitl_shim/mavlink/", "shim: messages"),
    ("sitl_shim/autopilot/", "shim: autopilot"),
    ("sitl_shim/", "shim: plant, wind, sensors, clock"),
    ("companion/control/", "companion: control laws"),
    ("companion/trajectories/", "companion: control laws"),
    ("companion/flight/setpoints/", "companion: control loop around the laws"),
    ("companion/mavlink/", "companion: messages"),
    ("companion/link/", "companion: messages"),
    ("companion/flight/vehicle/", "companion: messages"),
    ("companion/recording/", "companion: records and log"),
    ("companion/flight/records", "companion: records and log"),
    ("companion/flight/clock", "event loop"),
    ("companion/report/", "companion: figures and page, after the landing"),
    ("companion/", "companion: the rest"),
    ("asyncio/", "event loop"),
)
"""Whose code it is, by the innermost frame that is known; libraries count for who called them."""


def options(parser: argparse.ArgumentParser) -> None:
    """The benchmark's own."""
    parser.add_argument("--before", default=_FIRST, help=f"commit to compare with [{_FIRST}]")
    parser.add_argument("--rounds", type=int, default=2, help="flights of each [2]")
    parser.add_argument("--trajectory", type=int, default=4, help="1 ... 5 [4]")


def run(asked: argparse.Namespace) -> Report:
    """Check both out, and fly them in turns."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        commits = {"before": asked.before, "now": _name_of("HEAD")}
        for name, commit in commits.items():
            _check_out(commit, folder / name)
        flown: dict[str, list[dict[str, Any]]] = {name: [] for name in commits}
        for _ in range(asked.rounds):
            for name in commits:
                flown[name].append(_fly_apart(folder / name, asked.trajectory))
    figures: dict[str, Any] = {
        "trajectory": asked.trajectory,
        "rounds": asked.rounds,
        "commits": commits,
        "work_noise": {name: round(value, 3) for name, value in work_noise().items()},
    }
    for name, flights in flown.items():
        figures[name] = _figures(flights)
    figures["times_as_fast"] = round(
        figures["before"]["processor_s"] / figures["now"]["processor_s"], 2
    )
    return figures, _lines(figures)


def _name_of(commit: str) -> str:
    words = ["git", "rev-parse", "--short", commit]
    return subprocess.run(
        words, cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.strip()


def _check_out(commit: str, folder: Path) -> None:
    """The files of a commit, and nothing of the repository's state."""
    folder.mkdir()
    files = subprocess.run(
        ["git", "archive", "--format=tar", commit], cwd=ROOT, capture_output=True, check=True
    ).stdout
    subprocess.run(["tar", "-x", "-C", str(folder)], input=files, check=True)


def _fly_apart(checkout: Path, trajectory: int) -> dict[str, Any]:
    """A warm flight of a checkout in a process of its own."""
    with tempfile.TemporaryDirectory() as out:
        words = [sys.executable, __file__, "--fly", str(checkout), str(trajectory), out]
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            words, cwd=checkout, env=environment, capture_output=True, text=True, check=True
        )
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def _fly_here(checkout: str, trajectory: str, out: str) -> None:
    """In that process: fly to warm up, then under the profiler, and tell."""
    sys.path.insert(0, checkout)
    from companion.cli import main as companion

    seen: Counter[str] = Counter()

    def sample(_: int, frame: FrameType | None) -> None:
        seen[_part_of(frame)] += 1

    def fly(name: str) -> float:
        sys.argv = ["companion", "fly", f"--traj={trajectory}", "--lockstep", f"--out={out}/{name}"]
        begin = time.process_time()
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()), suppress(SystemExit):
            companion()
        return time.process_time() - begin

    fly("warm")
    plain_s = fly("plain")
    signal.signal(signal.SIGPROF, sample)
    signal.setitimer(signal.ITIMER_PROF, _SAMPLE_S, _SAMPLE_S)
    fly("sampled")
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    print(json.dumps({"processor_s": plain_s, "samples": seen}))


def _part_of(frame: FrameType | None) -> str:
    while frame is not None:
        path = frame.f_code.co_filename.replace(os.sep, "/")
        for piece, part in _PARTS:
            if f"/{piece}" in path:
                return part
        frame = frame.f_back
    return "the rest"


def _figures(flights: list[dict[str, Any]]) -> dict[str, Any]:
    """Processor time of a flight with its drawing of figures, and each part's of it."""
    taken_s = median(flight["processor_s"] for flight in flights)
    samples: Counter[str] = Counter()
    for flight in flights:
        samples.update(flight["samples"])
    total = sum(samples.values())
    return {
        "processor_s": round(taken_s, 3),
        "share": {part: round(count / total, 4) for part, count in samples.most_common()},
        "seconds": {part: round(taken_s * n / total, 3) for part, n in samples.most_common()},
    }


def _lines(figures: dict[str, Any]) -> list[str]:
    before, now = figures["before"], figures["now"]
    lines = [f"{'processor time of a flight, s':42}{'before':>8}{'now':>8}"]
    for part in before["seconds"] | now["seconds"]:
        pair = (of["seconds"].get(part, 0.0) for of in (before, now))
        lines.append(f"  {part:40}" + "".join(f"{value:8.2f}" for value in pair))
    lines.append(f"  {'all':40}{before['processor_s']:8.2f}{now['processor_s']:8.2f}")
    return [*lines, f"{figures['times_as_fast']} times as fast as {figures['commits']['before']}"]


if __name__ == "__main__":
    if sys.argv[1:2] == ["--fly"]:
        _fly_here(*sys.argv[2:])
    else:
        main("profiles", "What takes a flight's time, then and now.", run, options)
