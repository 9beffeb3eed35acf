"""The result of a flight as one flat object: `result.json` and what `--json` prints."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from companion.config.models import MissionConfig
from companion.flight.conduct import Outcome
from companion.flight.setpoints.stack_runner import Change
from companion.report.metrics import ErrorFigures, TrackingFigures

RESULT_NAME = "result.json"


def result_object(
    mission: MissionConfig,
    outcome: Outcome,
    figures: TrackingFigures | None,
    *,
    wall_s: float,
    log_dir: Path | None,
    event: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """Join outcome and figures; lengths are metres, rounded to a hundredth of a millimetre.

    Args:
        mission: what was asked for.
        outcome: of the flight.
        figures: of its tracking, if there is any.
        wall_s: how long the flight took.
        log_dir: of its logs.
        event: what the simulation's scenario did to it, as `event_object` says it.
    """
    reported = figures.as_reported if figures else None
    best = (figures.against_truth if figures else None) or reported
    wind_peak = figures.wind_peak_m_s2 if figures else None
    result = {
        "trajectory": mission.trajectory,
        "controller": mission.controller,
        "wind": mission.wind if mission.connect is None else None,
        "vehicle": mission.vehicle,
        "autopilot": outcome.autopilot,
        "setpoint": mission.setpoint,
        "seed": mission.seed if mission.connect is None else None,
        "outcome": outcome.outcome,
        "completed": outcome.completed,
        "note": outcome.note,
        "mean_tracking_error_m": _length(best, "mean_m"),
        "rms_tracking_error_m": _length(best, "rms_m"),
        "max_tracking_error_m": _length(best, "max_m"),
        "reported_mean_tracking_error_m": _length(reported, "mean_m"),
        "error_against": _error_against(figures),
        "fan_or_wind_peak_accel_m_s2": None if wind_peak is None else round(wind_peak, 3),
        "event": event,
        "ticks": outcome.ticks,
        "missed_deadlines": outcome.missed_deadlines,
        "fallbacks": outcome.fallbacks,
        "rejected_packets": (
            None if outcome.rejected_packets is None else dict(outcome.rejected_packets)
        ),
        "controller_changes": [_change(change) for change in outcome.changes],
        "monitor_worst": (
            None
            if outcome.monitor_worst is None
            else {name: round(value, 3) for name, value in outcome.monitor_worst.items()}
        ),
        "r_max_active_share": round(outcome.r_max_active_share, 3),
        "latency_ms": None if outcome.latency is None else asdict(outcome.latency),
        "timer_noise_ms": None if outcome.timer_noise is None else asdict(outcome.timer_noise),
        "flight_s": round(outcome.flight_s, 3),
        "wall_s": round(wall_s, 3),
        "log_dir": None if log_dir is None else str(log_dir),
    }
    return {key: _without_nan(value) for key, value in result.items()}


def _change(change: Change) -> dict[str, Any]:
    """A hand-over between controllers, or a warning; t counts from the trajectory's start."""
    return {
        "t_s": round(change.track_s, 3),
        "controller": change.controller,
        "cause": change.cause,
        "handed_over": change.handed_over,
        "text": change.text,
    }


def _error_against(figures: TrackingFigures | None) -> str | None:
    if figures is None or (figures.against_truth is None and figures.as_reported is None):
        return None
    return "reported position" if figures.against_truth is None else "truth"


def _without_nan(value: Any) -> Any:  # noqa: ANN401 - any JSON value
    """JSON has no NaN and no infinity: null says that there is no figure."""
    if isinstance(value, dict):
        return {key: _without_nan(inner) for key, inner in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _length(figures: ErrorFigures | None, key: str) -> float | None:
    return None if figures is None else round(float(getattr(figures, key)), 5)


def write_result(folder: Path, result: dict[str, Any]) -> None:
    """Write `result.json` beside the logs."""
    text = json.dumps(result, indent=2, ensure_ascii=False, allow_nan=False)
    (folder / RESULT_NAME).write_text(text + "\n", encoding="utf-8")
