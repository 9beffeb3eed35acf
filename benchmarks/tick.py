"""The control tick, and its quadratic programme given to many solvers, side by side in one run.

    python benchmarks/tick.py [--quick] [--json] [--keep]

Recorded inputs (benchmarks/data) of 2,400 receding-horizon ticks, all three axes at each tick: the
set *std*, of which 20-30 % of the ticks are constrained, and *hard*, nearly all.  One pinned core,
one thread, no collection of garbage, warm; the contenders take turns of 96 ticks; of each tick the
least time of the repeats counts.  Errors are those of the first input against the exact optimum.
"""

import os

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import argparse  # noqa: E402
import sys  # noqa: E402
from collections.abc import Sequence  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.harness import Report, main, work_noise  # noqa: E402
from benchmarks.tick.contenders import Contender, contenders  # noqa: E402
from benchmarks.tick.inputs import HORIZONS, SETS  # noqa: E402
from benchmarks.tick.measure import exponent, measure  # noqa: E402
from benchmarks.tick.problem import MODEL, PERIOD_S, WEIGHTS  # noqa: E402
from benchmarks.tick.race import TURN, pin_to_one_core  # noqa: E402
from benchmarks.tick.verdicts import verdicts  # noqa: E402

HORIZON = 30
QUICK_HORIZONS = (10, 30, 80)
OTHER_PROBLEMS = {
    "TinyMPC": (
        "it can't state this problem: its cost at the horizon's end is that of an infinite one, so "
        "that it has another optimum (and it comes without a wheel for Linux: 0.0.8)"
    )
}
"""Solvers that were looked at and can't be compared at equal accuracy."""


def run(asked: argparse.Namespace) -> Report:
    """Measure all, and say it."""
    core = pin_to_one_core()
    everyone = contenders()
    noise = work_noise()
    sets: dict[str, Any] = {}
    left_out = dict(OTHER_PROBLEMS)
    repeats = 2 if asked.quick else asked.repeats
    for name in SETS:
        recorded = f"{name}-{HORIZON}" if asked.quick else name
        sets[name], missing = measure(recorded, HORIZON, everyone, repeats=repeats)
        left_out |= missing
    solvers = [c for c in everyone if c.kind != "flight" and not (asked.quick and c.slow)]
    horizons = over_horizons(solvers, QUICK_HORIZONS if asked.quick else HORIZONS, repeats)
    found = {
        "problem": {
            "period_s": PERIOD_S,
            "weights": {"q": WEIGHTS.q, "r": WEIGHTS.r, "s": WEIGHTS.s},
            "m": list(MODEL.m),
            "k": list(MODEL.gain_k),
        },
        "quick": asked.quick,
        "core": core,
        "repeats": repeats,
        "turn": TURN,
        "work_noise": {name: round(value, 3) for name, value in noise.items()},
        "sets": sets,
        "left_out": left_out,
        "horizons": horizons,
        "verdicts": verdicts(sets["std"], horizons),
    }
    return found, list(lines(found))


def over_horizons(
    solvers: Sequence[Contender], horizons: Sequence[int], repeats: int
) -> dict[str, Any]:
    """Times over N_h, and the powers that fit them."""
    runs = {
        name: [measure(f"{name}-{n}", n, solvers, repeats=repeats)[0] for n in horizons]
        for name in SETS
    }
    told: dict[str, Any] = {}
    for name in runs["std"][0]["contenders"]:
        std, hard = ([run["contenders"][name] for run in runs[kind]] for kind in SETS)
        medians, tails = [r["median_us"] for r in std], [r["p99_us"] for r in hard]
        told[name] = {
            "kind": std[0]["kind"],
            "std_median_us": medians,
            "hard_p99_us": tails,
            "worst_error_mm": [
                max(a["worst_error_mm"], b["worst_error_mm"])
                for a, b in zip(std, hard, strict=True)
            ],
            "exponent_std_median": round(exponent(horizons, medians), 2),
            "exponent_hard_p99": round(exponent(horizons, tails), 2),
        }
    return {
        "values": list(horizons),
        "ticks": runs["std"][0]["ticks"],
        "constrained_share": {k: [r["constrained_share"] for r in runs[k]] for k in SETS},
        "contenders": told,
    }


def lines(found: dict[str, Any]) -> list[str]:
    """What a person reads."""
    said = []
    for name, one in found["sets"].items():
        share = 100.0 * one["constrained_share"]
        said.append(f"{name}: {one['ticks']} ticks, {share:.0f} % constrained, N_h {HORIZON}")
        said.append(f"  {'':34}{'median':>9}{'p99':>9}{'max':>9} µs{'worst error':>14} mm")
        for who, row in one["contenders"].items():
            times = "".join(f"{row[key]:9.1f}" for key in ("median_us", "p99_us", "max_us"))
            said.append(f"  {who:34}{times}   {row['worst_error_mm']:14.2g}")
    horizons = found["horizons"]
    heads = "".join(f"{n:8d}" for n in horizons["values"])
    said.append(f"over N_h, µs:{'':23}{heads}   exponent")
    for who, row in horizons["contenders"].items():
        for key, told in (("std_median", "median, std"), ("hard_p99", "p99, hard")):
            times = "".join(f"{value:8.1f}" for value in row[f"{key}_us"])
            said.append(f"  {who if key == 'std_median' else '':34.34}{times}")
            said[-1] += f"{row[f'exponent_{key}']:8.2f}  {told}"
    said += [f"left out: {who}: {why}" for who, why in found["left_out"].items()]
    for one in found["verdicts"]:
        limit = f"{'at most' if one['at_most'] else 'at least'} {one['limit']:g}"
        verdict = "holds" if one["holds"] else "DOES NOT HOLD"
        said.append(f"{one['what']}: {one['found']:g} {one['unit']} ({limit}): {verdict}")
    return said


def options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("--quick", action="store_true", help="fewer ticks and horizons, 20 s")
    parser.add_argument("--repeats", type=int, default=4, help="of each tick; the least counts")


if __name__ == "__main__":
    main("tick", __doc__, run, options)
