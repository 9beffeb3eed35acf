"""The section on flights in lockstep."""

from collections.abc import Mapping
from typing import Any

from tools.performance_page.markdown import figure, holds, table
from tools.performance_page.results import Result


def section(result: Result) -> list[str]:
    """Speeds, what takes the time, and simulations alone beside them."""
    found = result.figures
    flights = found["flights"]
    rows = [
        (
            f"{one['autopilot']}, {one['equations']} equations",
            figure(one["times_real_time"]["median"]),
            _range(one["times_real_time"]),
            figure(one["times_real_time_by_wall"]["median"]),
            f"≥ {one['goal']:g}",
            holds(one["times_real_time"]["median"] >= one["goal"]),
        )
        for one in flights
    ]
    heads = ["flight", "× real time", "range", "by the wall's clock", "limit", ""]
    return [
        (
            f"Trajectory {found['trajectory']}, {found['repeats']} rounds, in one process. Speeds "
            "are simulated seconds over seconds of processor time."
        ),
        "",
        *table(heads, rows),
        *_parts(flights),
        "![What takes the time of a simulated second](images/performance-lockstep.svg)",
        "",
        *_steps(found),
        *([f"Left out: {found['left_out']}.", ""] if "left_out" in found else []),
    ]


def noise(result: Result) -> str:
    """How far apart the same flight's speeds were."""
    widest = max(
        one["times_real_time"]["most"] / one["times_real_time"]["least"]
        for one in result.figures["flights"]
    )
    return f"the same flight's speeds were up to {100.0 * (widest - 1.0):.0f} % apart"


def _parts(flights: list[Mapping[str, Any]]) -> list[str]:
    parts = dict.fromkeys(part for one in flights for part in one["ms_per_s"])
    rows = [
        (part, *(figure(one["ms_per_s"].get(part, 0.0), 2) for one in flights)) for part in parts
    ]
    rows.append(("all", *(figure(one["processor_ms_per_s"]) for one in flights)))
    heads = [f"{one['autopilot']}, {one['equations']}" for one in flights]
    return table(["ms of processor for a simulated second", *heads], rows)


def _steps(found: Mapping[str, Any]) -> list[str]:
    rows = [
        (name, figure(rate["median"]), _range(rate)) for name, rate in found["steps_per_s"].items()
    ]
    what = [f"- *{name}*: {text}" for name, text in found["what_each_does"].items()]
    return [
        "What each of these does is not the same:",
        "",
        *what,
        "",
        *table([f"steps of {found['step_ms']:g} ms, alone", "per second", "range"], rows),
    ]


def _range(spread: Mapping[str, float]) -> str:
    return f"{figure(spread['least'])}–{figure(spread['most'])}"
