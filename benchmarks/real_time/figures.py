"""What is told of segments: latencies, deadlines, noise, memory."""

import json
from collections.abc import Sequence
from typing import Any

from benchmarks.harness import quantiles
from benchmarks.real_time.segment import Segment

DEADLINE_MS = 5.0
"""A setpoint is late after this."""
_STRETCH_NS = 500_000_000
"""Setpoints further apart are of two streams: between them none was asked for."""
_SETTLED_S = 15.0
"""Memory is compared with what was held then: imports and first records are over."""


def figures_of(segments: Sequence[Segment]) -> dict[str, Any]:
    """Of segments of one client under one load, together."""
    pairs = [took / 1e6 for segment in segments for _, took in segment.pairs_ns]
    noise = [late for segment in segments for late in segment.noise_ms]
    latency, timer = quantiles(pairs), quantiles(noise)
    unanswered = sum(_unanswered(segment) for segment in segments)
    late = sum(took > DEADLINE_MS for took in pairs)
    seconds = sum(_streamed_s(segment) for segment in segments)
    figures: dict[str, Any] = {
        "streamed_s": round(seconds, 1),
        "setpoints": len(pairs),
        "setpoints_per_s": round(len(pairs) / seconds, 1),
        "latency_ms": _rounded(latency),
        "timer_noise_ms": _rounded(timer),
        "p99_above_noise_ms": round(latency["p99"] - timer["p99"], 3),
        "by_segment_ms": [
            _rounded(quantiles([took / 1e6 for _, took in segment.pairs_ns]))
            for segment in segments
        ],
        "late": late,
        "unanswered": unanswered,
        "repeated": sum(segment.repeated for segment in segments),
        "processor_share": round(
            sum(segment.processor_share for segment in segments) / len(segments), 3
        ),
        "memory_mib": [_memory(segment) for segment in segments],
    }
    own = [json.loads(segment.said) for segment in segments if segment.said.startswith("{")]
    if own:
        names = ("outcome", "ticks", "missed_deadlines", "latency_ms", "timer_noise_ms")
        figures["own_records"] = [{name: result.get(name) for name in names} for result in own]
    return figures


def lines_of(name: str, figures: dict[str, Any]) -> list[str]:
    """The same for a person."""
    latency, noise = figures["latency_ms"], figures["timer_noise_ms"]
    lines = [
        (
            f"{name}: {figures['setpoints']} setpoints in {figures['streamed_s']} s "
            f"({figures['setpoints_per_s']}/s), {figures['processor_share']:.0%} of a processor"
        ),
        (
            f"  state out to setpoint in, ms   p50 {latency['p50']:.3f}  p99 {latency['p99']:.3f}  "
            f"max {latency['max']:.3f}"
        ),
        (
            f"  timer noise, same run, ms      p50 {noise['p50']:.3f}  p99 {noise['p99']:.3f}  "
            f"max {noise['max']:.3f}"
        ),
        f"  p99 above the noise            {figures['p99_above_noise_ms']:.3f} ms",
        (
            f"  later than {DEADLINE_MS:g} ms: {figures['late']}, never answered: "
            f"{figures['unanswered']}, repeated: {figures['repeated']}"
        ),
    ]
    if len(figures["by_segment_ms"]) > 1:
        each = "  ".join(
            f"{part['p50']:.3f}/{part['p99']:.3f}" for part in figures["by_segment_ms"]
        )
        lines.append(f"  p50/p99 of each segment, ms     {each}")
    for held in figures["memory_mib"]:
        lines.append(
            f"  resident memory, MiB: {held['settled']} after {_SETTLED_S:g} s, "
            f"{held['end']} at the end, {held['peak']} at most"
        )
    for own in figures.get("own_records", ()):
        lines.append(f"  its own records: {json.dumps(own)}")
    return lines


def _rounded(values: dict[str, float]) -> dict[str, float]:
    return {name: round(value, 4) for name, value in values.items()}


def _stretches(segment: Segment) -> list[tuple[int, int]]:
    """First and last answered state of each stretch in which setpoints flowed, ns."""
    found: list[tuple[int, int]] = []
    for moment, _ in sorted(segment.pairs_ns):
        if found and moment - found[-1][1] <= _STRETCH_NS:
            found[-1] = (found[-1][0], moment)
        else:
            found.append((moment, moment))
    return found


def _streamed_s(segment: Segment) -> float:
    return sum(last - first for first, last in _stretches(segment)) / 1e9


def _unanswered(segment: Segment) -> int:
    """States within the stretches that no setpoint came for."""
    stretches = _stretches(segment)
    within = sum(
        any(first <= moment <= last for first, last in stretches) for moment in segment.samples_ns
    )
    return within - len(segment.pairs_ns)


def _memory(segment: Segment) -> dict[str, float]:
    """While setpoints flowed, and at most; the most is held after the landing, to draw."""
    begin_ns, end_ns = segment.rss_mib[0][0] + int(_SETTLED_S * 1e9), segment.pairs_ns[-1][0]
    flown = [mib for moment, mib in segment.rss_mib if begin_ns <= moment <= end_ns]
    flown = flown or [segment.rss_mib[-1][1]]  # a segment too short to settle
    return {
        "settled": round(flown[0], 1),
        "end": round(flown[-1], 1),
        "peak": round(max(mib for _, mib in segment.rss_mib), 1),
    }
