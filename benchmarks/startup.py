"""How long the companion takes to say something, and what it holds.

    python benchmarks/startup.py [--runs 7] [--json] [--keep]

Whole processes, from their start to their end: `companion --help` and `--version`, with cached
bytecode and without any (of Python's own library and of others neither); then a flight in
lockstep, from the start of its process to its first event, to its first setpoints' mode, to its
end; and which packages the imports of each take their time for.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.harness import ROOT, Report, main

_COMPANION = (sys.executable, "-m", "companion")
_GOAL_S = 0.3
_IMPORTED = re.compile(r"import time:\s+(\d+) \|\s+\d+ \|\s*(\S+)")
_EVENT = re.compile(r"\s*[\d.]+ s\s+(.+?)(?:\s{2,}|$)")
_EVENTS = ("connect", "engage", "track")
"""Of the flight: the link is open; setpoints flow and the mode is theirs; it tracks."""
_PACKAGES_TOLD = 12


@dataclass(frozen=True, slots=True)
class Ran:
    """One process."""

    wall_s: float
    processor_s: float
    peak_mib: float
    lines: list[tuple[float, str]]
    """Of the standard error, with the time since the start, s."""


def options(parser: argparse.ArgumentParser) -> None:
    """The benchmark's own."""
    parser.add_argument("--runs", type=int, default=7, help="of each command [7]")


def run(asked: argparse.Namespace) -> Report:
    """Start things again and again."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        warm = {"PYTHONPYCACHEPREFIX": str(folder / "warm")}
        flight = [*_COMPANION, "fly", "--traj=4", "--lockstep"]
        commands = {
            "python": [sys.executable, "-c", "pass"],
            "companion --help": [*_COMPANION, "--help"],
            "companion --version": [*_COMPANION, "--version"],
        }
        _ran([*flight, f"--out={folder / 'first'}"], warm)  # caches the bytecode
        figures: dict[str, Any] = {}
        for name, command in commands.items():
            _ran(command, warm)
            figures[name] = _figures([_ran(command, warm) for _ in range(asked.runs)])
        cold = [
            _ran(commands["companion --help"], {"PYTHONPYCACHEPREFIX": str(folder / f"cold-{k}")})
            for k in range(max(1, asked.runs // 2))
        ]
        figures["companion --help, no bytecode"] = _figures(cold)
        flights = [
            _ran([*flight, f"--out={folder / f'flight-{k}'}"], warm)
            for k in range(max(1, asked.runs // 2))
        ]
        figures["companion fly --lockstep"] = _figures(flights) | {"events_s": _events(flights)}
        packages = {
            "companion --help": _packages([*_COMPANION, "--help"], warm),
            "companion fly --lockstep": _packages([*flight, f"--out={folder / 'last'}"], warm),
        }
    return {"processes": figures, "imports_ms": packages, "goal_help_s": _GOAL_S}, _lines(
        figures, packages
    )


def _ran(command: Sequence[str], environment: Mapping[str, str]) -> Ran:
    """Run a command to its end.

    Raises:
        CalledProcessError: it has failed.
    """
    begin = time.perf_counter()
    with subprocess.Popen(
        command,
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env=_environment(environment),
    ) as process:
        assert process.stderr is not None
        lines = [(time.perf_counter() - begin, line) for line in process.stderr]
        # Not `wait`: only this tells what that one process used.
        _, status, used = os.wait4(process.pid, 0)
        wall_s = time.perf_counter() - begin
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        said = "".join(line for _, line in lines)[-2000:]
        raise subprocess.CalledProcessError(process.returncode, command, stderr=said)
    return Ran(wall_s, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0, lines)


def _environment(extra: Mapping[str, str]) -> dict[str, str]:
    """Ours, with bytecode written, whatever is usual here."""
    ours = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    return ours | dict(extra)


def _figures(ran: Sequence[Ran]) -> dict[str, Any]:
    return {
        "runs": len(ran),
        "wall_s": {
            "min": round(min(one.wall_s for one in ran), 3),
            "median": round(median(one.wall_s for one in ran), 3),
            "max": round(max(one.wall_s for one in ran), 3),
        },
        "processor_s": round(median(one.processor_s for one in ran), 3),
        "peak_memory_mib": round(median(one.peak_mib for one in ran), 1),
    }


def _events(flights: Sequence[Ran]) -> dict[str, float]:
    """Median time from a process's start until it told of an event, s."""
    found: dict[str, list[float]] = {}
    for flight in flights:
        for time_s, line in flight.lines:
            told = _EVENT.match(line)
            if told and told[1] in _EVENTS:
                found.setdefault(told[1], []).append(time_s)
    return {name: round(median(times), 3) for name, times in found.items()}


def _packages(command: Sequence[str], environment: Mapping[str, str]) -> dict[str, float]:
    """Time that the imports of each package took themselves, ms, the greatest first.

    Python's own library is one package.  Telling it takes time, too: only the shares mean much.
    """
    ran = _ran([command[0], "-X", "importtime", *command[1:]], environment)
    own: Counter[str] = Counter()
    for _, line in ran.lines:
        imported = _IMPORTED.match(line)
        if imported:
            package = imported[2].partition(".")[0]
            known = package in sys.stdlib_module_names
            own["(standard library)" if known else package] += int(imported[1])
    return {name: round(spent / 1000.0, 1) for name, spent in own.most_common()}


def _lines(figures: Mapping[str, Any], packages: Mapping[str, Mapping[str, float]]) -> list[str]:
    lines = []
    for name, of_one in figures.items():
        wall = of_one["wall_s"]
        lines.append(
            f"{name:32} {wall['median']:7.3f} s ({wall['min']:.3f} to {wall['max']:.3f}), "
            f"processor {of_one['processor_s']:.3f} s, {of_one['peak_memory_mib']:.0f} MiB"
        )
        for event, time_s in of_one.get("events_s", {}).items():
            lines.append(f"  {event:30} {time_s:7.3f} s after its process's start")
    reached = figures["companion --help"]["wall_s"]["median"] <= _GOAL_S
    lines.append(f"goal, --help within {_GOAL_S} s: {'yes' if reached else 'no'}")
    for name, spent in packages.items():
        told = list(spent.items())[:_PACKAGES_TOLD]
        each = ", ".join(f"{package} {ms:.0f}" for package, ms in told)
        lines.append(f"imports of {name}, ms each: {each}; all {sum(spent.values()):.0f}")
    return lines


if __name__ == "__main__":
    main("startup", "How long the companion takes to say something, and its memory.", run, options)
