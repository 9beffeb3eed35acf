"""The result of a flight that has none: its program was killed, or flies on."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from companion.config.resolve import FlightConfig
from companion.flight.conduct import Outcome
from companion.flight.records import CONTROL, INPUT
from companion.flight.setpoints.inputs import START
from companion.flight.setpoints.timing import Punctuality, percentiles_ms
from companion.recording.mcap_log import LogRecord
from companion.report.flight_page.answer import tracked_s
from companion.report.flight_page.story import Story
from companion.report.metrics import tracking_figures
from companion.report.recovery import event_object
from companion.report.result import result_object

UNFINISHED = "unfinished"
"""In the place of an outcome."""


def cut_off_result(
    config: FlightConfig,
    story: Story,
    log: Mapping[str, Sequence[LogRecord]],
    scored_s: tuple[float, float] | None,
    folder: Path,
) -> dict[str, Any]:
    """What `result.json` would say if the flight had ended where its log does.

    Args:
        config: of the flight.
        story: what was recorded.
        log: records by topic.
        scored_s: autopilot's times between which tracking would have been scored.
        folder: of the logs.
    """
    ticks = story.data.ticks
    scored_s = tracked_s(story.data, scored_s)
    last_s = max(records[-1].time_s for records in log.values() if records)
    punctuality = _punctuality(config.mission.state_rate_hz, log)
    in_real_time = bool((story.said.latency_s > 0.0).any())
    planned = ticks.plan != ""
    outcome = Outcome(
        outcome="aborted",
        completed=scored_s is not None and _came_to(story, scored_s[1]),
        note=_note(story),
        scored_s=scored_s,
        ticks=punctuality.ticks,
        missed_deadlines=punctuality.missed_deadlines,
        fallbacks=int(ticks.on_fallback.sum()),
        latency=percentiles_ms(punctuality.latencies) if in_real_time else None,
        timer_noise=None,
        r_max_active_share=float(ticks.r_max_active[planned].mean()) if planned.any() else 0.0,
        flight_s=last_s + story.autopilot_ahead_s if len(ticks.time_s) else 0.0,
    )
    figures = None if scored_s is None else tracking_figures(story.data, scored_s)
    event = None if scored_s is None else event_object(story.data, scored_s, lost=True)
    result = result_object(
        config.mission, outcome, figures, wall_s=0.0, log_dir=folder.resolve(), event=event
    )
    return result | {"outcome": UNFINISHED, "wall_s": None}


def _came_to(story: Story, end_s: float) -> bool:
    """Whether the trajectory was tracked to a time of the autopilot's clock."""
    ticks = story.data.ticks
    flown = ticks.time_s[~ticks.on_fallback & np.isfinite(ticks.desired_enu_m).all(axis=1)]
    return bool(len(flown)) and float(flown[-1]) >= end_s


def _note(story: Story) -> str:
    where = f" in the phase “{story.phases[-1].name}”" if story.phases else ""
    return f"the log ends{where}: the program was killed, or flies on"


def _punctuality(rate_hz: float, log: Mapping[str, Sequence[LogRecord]]) -> Punctuality:
    """Counted as the flight counts."""
    counted = Punctuality(period_s=1.0 / rate_hz)
    starts = [r for r in log.get(INPUT.topic, ()) if r.values.get("kind") == START]
    told = sorted([*starts, *log.get(CONTROL.topic, ())], key=lambda record: record.time_s)
    for record in told:
        if record.topic == INPUT.topic:
            counted.pause()
            continue
        received_s, latency_s = (record.values.get(k) for k in ("received_s", "latency_s"))
        if record.values.get("sent") and received_s is not None and latency_s is not None:
            counted.tick(received_s, received_s + latency_s)
    return counted
