"""The section on the real-time latency."""

from collections.abc import Mapping
from typing import Any

from tools.performance_page.markdown import figure, share, table
from tools.performance_page.results import Result

_GOAL_MS = 1.5


def section(result: Result) -> list[str]:
    """Latency of each client beside the timers' noise of the same run."""
    clients = result.figures["clients"]
    heads = ["client", "setpoints", "p50, ms", "p99, ms", "max, ms", "timer p99, ms"]
    heads += [
        "p99 above it, ms",
        "late",
        "unanswered",
        "missed deadlines",
        "processor",
        "memory, MiB",
    ]
    lines = [
        (
            "Late is a setpoint after more than 5 ms; missed deadlines are by the companion's own "
            f"records. Limit: the companion's p99 at most {_GOAL_MS:g} ms above the timer's. "
            "Memory: resident after 15 s, and at the end of the flight."
        ),
        "",
        *table(heads, (_row(name, one) for name, one in clients.items())),
    ]
    if any(len(one["by_segment_ms"]) > 1 for one in clients.values()):
        lines += _by_segment(clients)
    loops = result.figures.get("loops")
    if loops:
        lines += _loops(loops)
    left_out = result.figures.get("left_out", [])
    lines += [f"Left out, not installed: {', '.join(left_out)}.", ""] if left_out else []
    return [*lines, "![Latency of each client](images/performance-latency.svg)", ""]


def noise(result: Result) -> str:
    """How late the machine's timers were."""
    told = [
        f"{figure(one['timer_noise_ms']['p99'])} ms ({name})"
        for name, one in result.figures["clients"].items()
    ]
    return "a process that only sleeps was woken late, at the 99th percentile, by " + ", ".join(
        told
    )


def _row(name: str, one: Mapping[str, Any]) -> tuple[str, ...]:
    latency, timer = one["latency_ms"], one["timer_noise_ms"]
    missed = [own.get("missed_deadlines") for own in one.get("own_records", ())]
    known = [value for value in missed if value is not None]
    return (
        name,
        str(one["setpoints"]),
        *(figure(latency[key]) for key in ("p50", "p99", "max")),
        figure(timer["p99"]),
        figure(one["p99_above_noise_ms"]),
        str(one["late"]),
        str(one["unanswered"]),
        str(sum(known)) if known else "–",
        share(one["processor_share"]),
        "; ".join(f"{held['settled']:.0f}, {held['end']:.0f}" for held in one["memory_mib"]),
    )


def _by_segment(clients: Mapping[str, Any]) -> list[str]:
    rows = [
        (name, ", ".join(f"{figure(part['p50'])} / {figure(part['p99'])}" for part in parts))
        for name, one in clients.items()
        if len(parts := one["by_segment_ms"]) > 1
    ]
    return table(["client, part by part", "p50 / p99, ms"], rows)


def _loops(loops: Mapping[str, Any]) -> list[str]:
    keys = list(dict.fromkeys(key for took in loops.values() for key in took))
    rows = [(name, *(_told(took.get(key)) for key in keys)) for name, took in loops.items()]
    return table(["event loop alone", *(key.replace("_", " ") for key in keys)], rows)


def _told(value: Any) -> str:  # noqa: ANN401
    return figure(value) if isinstance(value, (int, float)) else str(value or "–")
