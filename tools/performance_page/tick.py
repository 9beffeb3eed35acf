"""The section on the control tick and its solvers."""

from collections.abc import Mapping
from typing import Any

from tools.performance_page.markdown import figure, holds, share, table
from tools.performance_page.results import Result

FLOOR = "closed form, no check"
_SETS = {"std": "an ordinary flight", "hard": "a bound that is nearly always active"}


def section(result: Result) -> list[str]:
    """Limits, both sets, growth with the horizon."""
    found = result.figures
    problem = found["problem"]
    q, r, s = (problem["weights"][name] for name in "qrs")
    return [
        (
            "The problem is the paper's: three decoupled axes, D(s) at "
            f"{1e3 * problem['period_s']:.0f} ms, weights q {q:g}, r {r:g}, s {s:g}, the second "
            "difference of the reference bounded on both sides. The inputs were recorded over the "
            "five test trajectories with disturbances and noise (`benchmarks/data`). Each tick "
            "solves all three axes. Everything runs in Python, in one thread, warm, without "
            f"garbage collection; the contenders take turns of {found['turn']} ticks in one run, "
            f"and of each tick the least of {found['repeats']} repeats counts (of the slow ones, "
            "2). *Worst error* is that of the first input against the exact optimum; tolerances "
            "were set so that it stays within 1 mm. *Floor* is the closed form without a look at "
            "any constraint."
        ),
        "",
        *_verdicts(found),
        *(line for name in found["sets"] for line in _set(name, found["sets"][name])),
        "![Time of a tick, each solver](images/performance-solvers.svg)",
        "",
        *_horizons(found["horizons"]),
        "![Time of a tick over the horizon](images/performance-horizons.svg)",
        "",
        *(f"Left out: {name}: {why}." for name, why in found["left_out"].items()),
        *([""] if found["left_out"] else []),
    ]


def noise(result: Result) -> str:
    """What the same piece of work takes at worst on this machine, over its median."""
    spread = result.figures["work_noise"]
    return (
        f"the same 50 µs of work took {spread['p99']:.2f} times its median at the 99th percentile "
        f"and {spread['max']:.1f} times at most"
    )


def _verdicts(found: Mapping[str, Any]) -> list[str]:
    rows = (
        (
            one["what"],
            f"{figure(one['found'])} {one['unit']}".strip(),
            f"{'≤' if one['at_most'] else '≥'} {one['limit']:g} {one['unit']}".strip(),
            holds(one["holds"]),
        )
        for one in found["verdicts"]
    )
    return table(["what", "found", "limit", ""], rows)


def _set(name: str, one: Mapping[str, Any]) -> list[str]:
    floor = one["contenders"].get(FLOOR, {}).get("median_us")
    rows = [
        (
            who,
            figure(row["median_us"]),
            figure(row["p99_us"]),
            figure(row["max_us"]),
            "–" if floor is None else figure(row["median_us"] / floor, 2),
            "–" if row["kind"] == "floor" else figure(row["worst_error_mm"], 2),
            ", ".join(filter(None, (row["library"], row["settings"]))),
        )
        for who, row in one["contenders"].items()
    ]
    heads = ["N_h " + str(one["horizon"]), "median, µs", "p99, µs", "max, µs", "× floor"]
    return [
        (
            f"**{name}**: {_SETS.get(name, name)}; {one['ticks']} ticks, of which "
            f"{share(one['constrained_share'])} have an active constraint."
        ),
        "",
        *table([*heads, "worst error, mm", "solver"], rows),
    ]


def _horizons(found: Mapping[str, Any]) -> list[str]:
    values = found["values"]
    lines = [
        (
            f"**Over the horizon**: {found['ticks']} ticks at each N_h, flown with that horizon; "
            f"constrained are {_range(found['constrained_share']['std'])} of *std* and "
            f"{_range(found['constrained_share']['hard'])} of *hard*. The exponent is that of the "
            "power of N_h that fits best."
        ),
        "",
    ]
    for key, told in (("std_median", "median, *std*, µs"), ("hard_p99", "p99, *hard*, µs")):
        rows = [
            (
                who,
                *(figure(value) for value in row[f"{key}_us"]),
                f"{row[f'exponent_{key}']:.2f}",
            )
            for who, row in found["contenders"].items()
        ]
        lines += table([told, *(f"N_h {n}" for n in values), "exponent"], rows)
    worst = {
        who: max(row["worst_error_mm"])
        for who, row in found["contenders"].items()
        if row["kind"] != "floor" and max(row["worst_error_mm"]) > 1.0
    }
    if worst:
        told = ", ".join(f"{who} ({figure(value, 2)} mm)" for who, value in worst.items())
        lines += [f"More than 1 mm off somewhere between these horizons: {told}.", ""]
    return lines


def _range(shares: list[float]) -> str:
    low, high = 100.0 * min(shares), 100.0 * max(shares)
    return f"{low:.0f}–{high:.0f} %"
