"""What a live page costs the flight beside it.

    python benchmarks/live.py [--rounds 2] [--viewers 5] [--json] [--keep]

Flights in real time over UDP, in turns: without a page; with one that nobody looks at; and with
browsers' WebSockets on it, one of which reads nothing at all.  Each is `companion fly`, whole, as a
process of its own; the figures are its own records' of latency, missed deadlines and the machine's
timers in the same run.  Beside them, how long the listener keeps the control loop: the feed alone,
with the records of a flight.
"""

import argparse
import asyncio
import contextlib
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from benchmarks.harness import Report, main, quantiles, timer_noise_ms
from companion.live.feed import LiveFeed, datagram_pair
from companion.recording.mcap_log import LogRecord, read_records
from tools.soak.figure_eight import write_figure_eight

_KINDS = ("no page", "a page, nobody looks", "a page, looked at")


def options(parser: argparse.ArgumentParser) -> None:
    """The benchmark's own."""
    parser.add_argument("--rounds", type=int, default=2, help="flights of each kind [2]")
    parser.add_argument("--viewers", type=int, default=5, help="WebSockets; the last reads nothing")
    parser.add_argument("--seconds", type=float, default=20.0, help="tracked in each flight [20]")


def run(asked: argparse.Namespace) -> Report:
    """Fly in turns."""
    flights: dict[str, list[dict[str, Any]]] = {kind: [] for kind in _KINDS}
    frames = 0
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        path = folder / "path.csv"
        write_figure_eight(path, asked.seconds)
        for number in range(asked.rounds):
            for kind in _KINDS:
                viewers = asked.viewers if kind == _KINDS[2] else 0
                out = folder / f"{_KINDS.index(kind)}-{number}"
                result, seen = asyncio.run(_fly(path, out, kind != _KINDS[0], viewers))
                flights[kind].append(result)
                frames += seen
        records = list(read_records(folder / "0-0" / "flight.mcap"))
    figures = {
        "viewers": asked.viewers,
        "frames_read": frames,
        "timer_noise_ms": timer_noise_ms(),
        "flights": {kind: [_short(result) for result in done] for kind, done in flights.items()},
        "feed_us": _feed_us(records),
    }
    return figures, _lines(figures)


async def _fly(path: Path, out: Path, page: bool, viewers: int) -> tuple[dict[str, Any], int]:
    """One flight; its result, and how many frames the reading viewers were sent."""
    command = [sys.executable, "-m", "companion", "fly", "--json", f"--traj={path}", f"--out={out}"]
    flight = await asyncio.create_subprocess_exec(
        *command,
        *(["--live"] if page else []),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert flight.stdout is not None
    assert flight.stderr is not None
    looking: list[asyncio.Task[int]] = []
    async for line in flight.stderr:
        text = line.decode()
        if text.startswith("live page: "):
            netloc = urlsplit(text.split()[-1]).netloc
            looking = [
                asyncio.create_task(_look(netloc, reads=k < max(1, viewers - 1)))
                for k in range(viewers)
            ]
    result: dict[str, Any] = json.loads(await flight.stdout.read())
    await flight.wait()
    for task in looking:
        task.cancel()
    seen = await asyncio.gather(*looking, return_exceptions=True)
    return result, sum(count for count in seen if isinstance(count, int))


async def _look(netloc: str, *, reads: bool) -> int:
    """A browser's WebSocket; counts frames until the flight is over."""
    from websockets.asyncio.client import connect

    frames = 0
    async with connect(f"ws://{netloc}/ws", close_timeout=0.1) as socket:
        if not reads:
            await asyncio.Event().wait()
        with contextlib.suppress(asyncio.CancelledError):
            async for text in socket:
                kind = json.loads(text)["type"]
                frames += kind == "frame"
                if kind == "end":
                    break
    return frames


def _feed_us(records: list[LogRecord]) -> dict[str, float]:
    """How long a record of a flight keeps its control loop for the page's sake, µs."""
    ours, theirs = datagram_pair()
    theirs.setblocking(False)
    taken = []
    with ours, theirs:
        feed = LiveFeed(ours)
        for record in records:
            begin = time.perf_counter()
            feed.on_record(record.topic, record.time_s, record.values)
            taken.append(1e6 * (time.perf_counter() - begin))
            with contextlib.suppress(BlockingIOError):
                theirs.recv(1 << 21)
    return quantiles(taken) | {"mean": sum(taken) / len(taken)}


def _short(result: dict[str, Any]) -> dict[str, Any]:
    names = ("outcome", "ticks", "missed_deadlines", "fallbacks", "latency_ms", "timer_noise_ms")
    return {name: result[name] for name in names}


def _lines(figures: dict[str, Any]) -> list[str]:
    lines = []
    for kind, done in figures["flights"].items():
        for flight in done:
            latency, noise = flight["latency_ms"], flight["timer_noise_ms"]
            lines.append(
                f"{kind:<22} {flight['outcome']}, {flight['missed_deadlines']} of "
                f"{flight['ticks']} deadlines missed, latency p50 {latency['p50']:.2f} p99 "
                f"{latency['p99']:.2f} max {latency['max']:.1f} ms (timers p99 {noise['p99']:.2f} "
                f"max {noise['max']:.1f})"
            )
    feed = figures["feed_us"]
    lines.append(
        f"the feed alone: {feed['mean']:.1f} µs a record, median {feed['p50']:.1f}, "
        f"p99 {feed['p99']:.1f}"
    )
    lines.append(f"frames read by {figures['viewers'] - 1} viewers: {figures['frames_read']}")
    return lines


if __name__ == "__main__":
    main("live", __doc__ or "", run, options)
