"""Did it track, and if not why: the first words of a flight's page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from companion.report.flight_data import FlightData
from companion.report.flight_page.findings import Finding
from companion.report.flight_page.place import place_on_path
from companion.report.flight_page.story import Story
from companion.report.metrics import event_while_scored, reported_error, true_error
from companion.report.pages.glance import Glance, KeyFigure, Level

WELL_MM = 100.0
"""A mean error above this is told as loose: ten times what the controller reaches in calm air."""
_GOOD = ("landed", "tracked")
_AFTER_EVENT_S = 3.0
_BLOWS_M_S2 = 0.2
_MOST_REASONS = 5


@dataclass(frozen=True, slots=True)
class Peak:
    """The largest error while tracking was scored."""

    error_mm: float
    at_s: float
    """Autopilot's."""
    since_start_s: float
    place: str
    push_m_s2: float
    """By the wind at that time; 0 if it is not known."""
    event: str
    """What the scenario did to the vehicle shortly before; empty for nothing."""


def tracked_s(data: FlightData, scored_s: tuple[float, float] | None) -> tuple[float, float] | None:
    """The scored times, if the flight came to them: None if tracking never began.

    Args:
        data: of the flight.
        scored_s: autopilot's times between which tracking is or would have been scored.
    """
    ticks = data.ticks
    if scored_s is None or not ((ticks.phase == "track") & (ticks.time_s >= scored_s[0])).any():
        return None
    return scored_s


def find_peak(data: FlightData, scored_s: tuple[float, float]) -> Peak | None:
    """The largest error by truth, else as reported; None if nothing was scored."""
    times, error = true_error(data, scored_s)
    if not len(error):
        times, error = reported_error(data, scored_s)
    if not len(error):
        return None
    at_s = float(times[int(np.argmax(error))])
    truth = data.truth
    push = 0.0
    if len(truth.wind_time_s):
        push = float(np.interp(at_s, truth.wind_time_s, truth.wind_acceleration_m_s2))
    event = event_while_scored(truth.events, scored_s)
    recent = event is not None and 0.0 <= at_s - event.time_s <= _AFTER_EVENT_S
    return Peak(
        float(error.max()) * 1e3,
        at_s,
        at_s - scored_s[0],
        place_on_path(data.ticks.time_s, data.ticks.desired_enu_m, at_s),
        push,
        event.text if recent and event is not None else "",
    )


def answer(
    result: Mapping[str, Any],
    story: Story | None,
    scored_s: tuple[float, float] | None,
    findings: Sequence[Finding],
) -> Glance:
    """The summary box.

    Args:
        result: as `result_object` makes it.
        story: the records; None where they can't be read.
        scored_s: autopilot's times between which tracking is scored; None if it never began.
        findings: what stands out.
    """
    peak = None if story is None or scored_s is None else find_peak(story.data, scored_s)
    level, sentence = _judge(result, story, scored_s, peak, findings)
    weighty = [f.text for f in findings if f.level in ("bad", "half")]
    return Glance(level, sentence, _figures(result, scored_s), tuple(weighty[:_MOST_REASONS]))


def _judge(
    result: Mapping[str, Any],
    story: Story | None,
    scored_s: tuple[float, float] | None,
    peak: Peak | None,
    findings: Sequence[Finding],
) -> tuple[Level, str]:
    note = _clause(str(result["note"] or ""))
    outcome = result["outcome"]
    if outcome == "refused":
        return "bad", _sentence(f"Did not fly: {note or 'it was refused'}")
    if not result["completed"]:
        return "bad", _not_to_the_end(outcome, note, story, scored_s)
    mean_m = result["mean_tracking_error_m"]
    if mean_m is None:
        ended = f"The trajectory was flown to its end and the flight {outcome}"
        return "none", _sentence(f"{ended}; the logs say nothing of the error")
    mean_mm = 1e3 * mean_m
    tracked = f"Tracked to {mean_mm:.1f} mm on average"
    if mean_mm > WELL_MM:
        tracked = f"Flew the trajectory to its end, but {mean_mm:.0f} mm off on average"
    if peak is not None:
        tracked += f"; the largest error, {_mm(peak.error_mm)}, came at {peak.since_start_s:.1f} s"
        tracked += _circumstances(peak)
    if outcome not in _GOOD:
        return "bad", _sentence(f"{tracked}. It did not end as planned: {note or outcome}")
    loose = mean_mm > WELL_MM or any(finding.level in ("half", "bad") for finding in findings)
    return "half" if loose else "good", _sentence(tracked)


def _circumstances(peak: Peak) -> str:
    text = f", {peak.place}" if peak.place else ""
    if peak.event:
        return f"{text}, after {peak.event}"
    if peak.push_m_s2 > _BLOWS_M_S2:
        return f"{text} where the air pushed with {peak.push_m_s2:.1f} m/s²"
    return text


def _not_to_the_end(
    outcome: str, note: str, story: Story | None, scored_s: tuple[float, float] | None
) -> str:
    phase, at_s = _last_phase(story)
    where = f" in the phase “{phase}”" if phase else ""
    if scored_s is None or story is None:
        when = f", {at_s:.1f} s after the log's beginning" if phase else ""
        return _sentence(
            f"Did not track: the flight was {_ended(outcome)}{where}{when}{_why(note)}"
        )
    left_s = _left_at_s(story, scored_s)
    text = (
        f"Did not track to the end: {left_s:.1f} s of {scored_s[1] - scored_s[0]:.1f} s were "
        f"flown, then the flight was {_ended(outcome)}"
    )
    return _sentence(text + _why(note))


def _left_at_s(story: Story, scored_s: tuple[float, float]) -> float:
    """How much of the trajectory was tracked."""
    ticks = story.data.ticks
    tracked = ticks.time_s[(ticks.phase == "track") & ~ticks.on_fallback]
    end = min(float(tracked[-1]), scored_s[1]) if len(tracked) else scored_s[0]
    return max(0.0, end - scored_s[0])


def _last_phase(story: Story | None) -> tuple[str, float]:
    """The phase in which it was decided, and when it ended, from the log's beginning."""
    if story is None or not story.phases:
        return "", 0.0
    phases = story.phases
    ends = ("handed over", "land", "hand over")
    flown = [phase for phase in phases if phase.name not in ends] or list(phases)
    return flown[-1].name, flown[-1].end_s - phases[0].begin_s


def _ended(outcome: str) -> str:
    return {"landed": "landed early", "unfinished": "cut off"}.get(outcome, outcome)


def _why(note: str) -> str:
    return f": {note}" if note else ""


def _figures(
    result: Mapping[str, Any], scored_s: tuple[float, float] | None
) -> tuple[KeyFigure, ...]:
    figures = []
    mean, rms, largest = (result[f"{name}_tracking_error_m"] for name in ("mean", "rms", "max"))
    if mean is not None:
        kind: Level | None = "half" if mean * 1e3 > WELL_MM else None
        if result["completed"] and kind is None:
            kind = "good"
        figures += [
            KeyFigure("mean error", f"{mean * 1e3:.1f}", "mm", kind),
            KeyFigure("rms", f"{rms * 1e3:.1f}", "mm"),
            KeyFigure("largest", f"{largest * 1e3:.1f}", "mm"),
        ]
    if scored_s is not None:
        figures.append(KeyFigure("scored for", f"{scored_s[1] - scored_s[0]:.1f}", "s"))
    push = result["fan_or_wind_peak_accel_m_s2"]
    if push:
        figures.append(KeyFigure("wind, at most", f"{push:.2f}", "m/s²"))
    latency = result["latency_ms"]
    if latency is not None:
        figures.append(KeyFigure("latency, p99", f"{latency['p99']:.2f}", "ms"))
    if result["ticks"]:
        missed, fallen = result["missed_deadlines"], result["fallbacks"]
        figures += [
            KeyFigure("setpoints", f"{result['ticks']}"),
            KeyFigure("deadlines missed", f"{missed}", "", "half" if missed else None),
            KeyFigure("on a fallback", f"{fallen}", "", "half" if fallen else None),
        ]
    return tuple(figures)


def _mm(value_mm: float) -> str:
    return f"{value_mm:.1f} mm" if value_mm < 999.5 else f"{value_mm / 1e3:.2f} m"


def _clause(text: str) -> str:
    """A note as the end of a sentence."""
    return text.strip().removesuffix(".")


def _sentence(text: str) -> str:
    return text if text.endswith((".", "!", "?")) else f"{text}."
