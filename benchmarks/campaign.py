"""How much faster a campaign is over two processes than over one, beside a plain load's gain.

`python benchmarks/campaign.py --flights 500` is the figure of the documentation: so many flights of
trajectory 4 over one process and over two, in rounds, with rounds of plain Python work over one and
two processes between them.  What two processes can gain on a machine is what the plain load gains:
caches, memory and clock rates are shared.
"""

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from multiprocessing import get_context
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.harness import Report, main

_SAYS = "Speed-up of a campaign over two processes, beside that of a plain load."
_GOAL = 0.9
_CAMPAIGN = """\
name: measured
keep: figures
base: {{trajectory: 4, wind: fan}}
sample: {{method: latin-hypercube, points: {points}, seed: {seed}}}
parameters:
  plant.mass: {{low: 0.9, high: 1.1}}
  plant.delay_s: {{low: 0.0, high: 0.02}}
  seed: {{low: 1, high: 100000, integer: true}}
"""
_PLAIN_S = 0.5
"""Of a piece of the plain load, about as long as a flight."""
_PLAIN_RARER = 8
"""A pair of pieces for so many flights: of work that is always the same less is needed."""


def _options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--flights", type=int, default=16, help="by each number of processes")
    parser.add_argument("--rounds", type=int, default=4, help="into which they are divided")


def _run(asked: argparse.Namespace) -> Report:
    rounds = max(1, min(asked.rounds, asked.flights // 2))
    shares = [
        asked.flights * (k + 1) // rounds - asked.flights * k // rounds for k in range(rounds)
    ]
    taken: dict[str, list[float]] = {name: [] for name in ("one", "plain_one", "two", "plain_two")}
    flown = {1: 0.0, 2: 0.0}
    with tempfile.TemporaryDirectory() as folder, _plain() as plain:
        _campaign(Path(folder), 2, 0, 2)  # the server that workers are forked from starts once
        for k, flights in enumerate(shares):
            names = list(taken) if k % 2 == 0 else list(taken)[::-1]
            for name in names:
                jobs = 2 if name.endswith("two") else 1
                if name.startswith("plain"):
                    taken[name].append(plain(2 * max(1, flights // _PLAIN_RARER), jobs))
                    continue
                wall_s, inside_s = _campaign(Path(folder), flights, k + 1, jobs)
                taken[name].append(wall_s)
                flown[jobs] += inside_s
    total = {name: sum(values) for name, values in taken.items()}
    gain, plain_gain = total["one"] / total["two"], total["plain_one"] / total["plain_two"]
    figures: dict[str, Any] = {
        "flights": asked.flights,
        "rounds": rounds,
        "flights_per_minute": {
            "one": 60.0 * asked.flights / total["one"],
            "two": 60.0 * asked.flights / total["two"],
        },
        "speed_up": gain,
        "plain_speed_up": plain_gain,
        "of_plain": gain / plain_gain,
        "of_plain_by_round": [
            (one / two) / (p_one / p_two)
            for one, p_one, two, p_two in zip(*taken.values(), strict=True)
        ],
        "goal": _GOAL,
        "overhead_ms_per_flight": {
            name: 1e3 * (jobs * total[name] - flown[jobs]) / asked.flights
            for name, jobs in (("one", 1), ("two", 2))
        },
        "seconds": taken,
    }
    per_minute, overhead = figures["flights_per_minute"], figures["overhead_ms_per_flight"]
    by_round = ", ".join(f"{value:.2f}" for value in figures["of_plain_by_round"])
    return figures, [
        f"{asked.flights} flights of trajectory 4 in {rounds} rounds",
        f"over 1 process   {per_minute['one']:6.1f} flights a minute",
        f"over 2 processes {per_minute['two']:6.1f} flights a minute: {gain:.3f} times as many",
        f"a plain load gains {plain_gain:.3f}",
        f"share of it: {figures['of_plain']:.3f} (goal: at least {_GOAL}; by round {by_round})",
        f"ms around a flight: {overhead['one']:.0f} of one process, {overhead['two']:.0f} of two",
    ]


def _campaign(folder: Path, flights: int, seed: int, jobs: int) -> tuple[float, float]:
    """How long a campaign took from its file to its table, and its flights alone, s."""
    import pyarrow.parquet as parquet

    from companion.commands.campaign import CampaignRequest, run_campaign_file

    file, out = folder / "measured.yaml", folder / "out"
    file.write_text(_CAMPAIGN.format(points=flights, seed=seed), encoding="utf-8")
    shutil.rmtree(out, ignore_errors=True)
    started = time.perf_counter()
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        all_flown = run_campaign_file(CampaignRequest(str(file), jobs=jobs, out=out))
    wall_s = time.perf_counter() - started
    rows = parquet.read_table(out / "results.parquet").to_pydict()
    if not all_flown or set(rows["outcome"]) != {"tracked"}:
        raise SystemExit(f"a flight did not track: {set(rows['outcome'])}, {set(rows['note'])}")
    return wall_s, sum(rows["wall_s"])


@contextmanager
def _plain() -> Iterator[Callable[[int, int], float]]:
    """Plain work: a function of how many pieces and how many processes, giving seconds."""
    count = 20_000
    while (spent_s := _burn(count)) < 0.1:
        count *= 2
    count = round(count * _PLAIN_S / spent_s)
    context = get_context("spawn")
    pools = {jobs: ProcessPoolExecutor(jobs, mp_context=context) for jobs in (1, 2)}

    def work(pieces: int, jobs: int) -> float:
        started = time.perf_counter()
        for _ in pools[jobs].map(_burn, [count] * pieces):
            pass
        return time.perf_counter() - started

    try:
        for jobs in pools:
            work(2 * jobs, jobs)
        yield work
    finally:
        for pool in pools.values():
            pool.shutdown()


def _burn(count: int) -> float:
    """Python at work as in a flight: floats, tuples, dictionaries, calls."""
    started = time.process_time()
    state, record = (0.1, 0.2, 0.3), {}
    for k in range(count):
        x, y, z = state
        state = _step(x, y, z)
        record[k & 255] = state
    return time.process_time() - started


def _step(x: float, y: float, z: float) -> tuple[float, float, float]:
    return x + 0.01 * (y - x), y + 0.01 * (x * (1.0 - z) - y), z + 0.01 * (x * y - z)


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    main("campaign", _SAYS, _run, _options)
