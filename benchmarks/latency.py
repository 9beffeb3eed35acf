"""State in to setpoint out over UDP in real time, seen from outside, beside MAVSDK's asyncio.

    python benchmarks/latency.py [--minutes 10] [--load] [--under 'chrt -f 10'] [--json] [--keep]

A shim flies; a relay between it and the client notes when each state leaves for the client and when
the setpoint that answers it comes back (SET_ATTITUDE_TARGET says the time of its state).  Beside
them a process of its own measures how late this machine's timers are.  The client is `companion
fly`, whole, with logs and all; and in segments before and after it, a loop that does as much with
MAVSDK: odometry in, attitude out.
"""

import argparse
import importlib.util
import json
import shlex
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.harness import Report, main
from benchmarks.real_time.figures import figures_of, lines_of
from benchmarks.real_time.loops import compare
from benchmarks.real_time.segment import Client, Segment, SegmentError, fly_segment
from companion.experiments.perturbed_plant import scaled, write_plant
from tools.soak.figure_eight import write_figure_eight

_VEHICLE = "bebop2"
_MAVSDK_AT_MOST_S = 60.0
_GOAL_MS = 1.5


def options(parser: argparse.ArgumentParser) -> None:
    """The benchmark's own."""
    parser.add_argument("--minutes", type=float, default=1.0, help="tracked in each flight [1]")
    parser.add_argument("--rounds", type=int, default=1, help="flights of each kind, in turn [1]")
    parser.add_argument(
        "--load", action="store_true", help="the same again with the last processor kept busy"
    )
    parser.add_argument(
        "--loops", action="store_true", help="asyncio's own event loop against uvloop's, alone"
    )
    parser.add_argument(
        "--under",
        action="append",
        default=[],
        metavar="COMMAND",
        help="the companion's flight also under this command, in turn: 'chrt -f 10'; repeatable",
    )
    parser.add_argument("--no-mavsdk", action="store_true", help="leave MAVSDK's segments out")


def run(asked: argparse.Namespace) -> Report:
    """Fly the segments in turn."""
    mavsdk = not asked.no_mavsdk and importlib.util.find_spec("mavsdk") is not None
    seconds = 60.0 * asked.minutes
    segments: list[Segment] = []
    failed: list[str] = []

    def fly(client: Client, *, loaded: bool) -> None:
        """What fails is told at the end; an hour's other segments are not lost by it."""
        try:
            segments.append(fly_segment(client, vehicle, loaded=loaded))
        except SegmentError as error:
            failed.append(str(error))

    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        write_figure_eight(folder / "eight.csv", seconds)
        # Of ten minutes it is to be the companion that is worn out.
        vehicle = write_plant(_VEHICLE, [scaled("battery", "capacity_a_h", by=10.0)], folder / "v")
        other = _mavsdk(min(seconds, _MAVSDK_AT_MOST_S))
        for loaded in (False, True) if asked.load else (False,):
            for _ in range(asked.rounds):
                for under in ("", *asked.under):
                    if mavsdk:
                        fly(other, loaded=loaded)
                    flight = folder / f"flight-{len(segments) + len(failed)}"
                    client = _companion(folder / "eight.csv", flight, under)
                    fly(client, loaded=loaded)
            if mavsdk:
                fly(other, loaded=loaded)
    left_out = [] if mavsdk or asked.no_mavsdk else ["mavsdk"]
    figures, lines = _report(segments)
    if asked.loops:
        figures["loops"] = found = compare()
        if found is None:
            left_out.append("uvloop")
        else:
            lines += [f"loop alone, {name}: {json.dumps(took)}" for name, took in found.items()]
    lines += [f"left out, not installed: {name}" for name in left_out]
    lines += [f"FAILED: {what}" for what in failed]
    return figures | {"left_out": left_out, "failed": failed}, lines


def _companion(trajectory: Path, out: Path, under: str) -> Client:
    command = [
        *shlex.split(under),
        *(sys.executable, "-m", "companion", "fly", "--connect={url}", "--json"),
        *(f"--traj={trajectory}", f"--vehicle={_VEHICLE}", f"--out={out}"),
    ]
    name = f"companion under {under}" if under else "companion"
    return Client(name, command)


def _mavsdk(seconds: float) -> Client:
    command = [sys.executable, "-m", "benchmarks.real_time.mavsdk_loop", "{url}", str(seconds)]
    return Client("MAVSDK asyncio", command, tagged=True)


def _report(segments: list[Segment]) -> Report:
    figures: dict[str, Any] = {}
    lines: list[str] = []
    kinds = dict.fromkeys((segment.loaded, segment.client) for segment in segments)
    for loaded, client in kinds:
        name = f"{client}, one processor busy" if loaded else client
        of_kind = [s for s in segments if (s.loaded, s.client) == (loaded, client)]
        figures[name] = found = figures_of(of_kind)
        lines += lines_of(name, found)
        if client.startswith("companion"):
            reached = found["p99_above_noise_ms"] <= _GOAL_MS
            lines.append(f"  goal, p99 at most {_GOAL_MS} ms above: {'yes' if reached else 'no'}")
            missed = sum(own["missed_deadlines"] for own in found.get("own_records", ()))
            kept = not (missed or found["late"] or found["unanswered"])
            lines.append(f"  goal, no deadline missed: {'yes' if kept else 'no'}")
    return {"clients": figures}, lines


if __name__ == "__main__":
    main("latency", "State in to setpoint out over UDP in real time.", run, options)
