"""Stories made of arrays and results made of words, whose findings are known."""

from dataclasses import replace

import numpy as np

from companion.report.flight_page.findings import Limits
from companion.report.flight_page.story import Message, Phase, Said, Story
from tests.companion.report.synthetic_flight import make_flight

LIMITS = Limits(35.0, 0.08, 0.95, 0.1)
SCORED_S = (5.0, 25.0)
RESULT = {
    "trajectory": 2,
    "controller": "mpc-l1",
    "wind": "calm",
    "vehicle": "bebop2",
    "autopilot": "px4",
    "seed": 0,
    "outcome": "landed",
    "completed": True,
    "note": "",
    "mean_tracking_error_m": 0.0209,
    "rms_tracking_error_m": 0.025,
    "max_tracking_error_m": 0.0576,
    "error_against": "truth",
    "fan_or_wind_peak_accel_m_s2": 0.0,
    "ticks": 3000,
    "missed_deadlines": 0,
    "fallbacks": 0,
    "rejected_packets": None,
    "controller_changes": [],
    "r_max_active_share": 0.0,
    "latency_ms": None,
    "flight_s": 30.0,
    "wall_s": 1.5,
}


def result(**changes):
    return RESULT | changes


def said_of(ticks, **changes):
    count = len(ticks.time_s)
    fields = {
        "log_time_s": ticks.time_s + 3.0,
        "latency_s": np.zeros(count),
        "loop_delay_s": np.full(count, 0.03),
        "state_age_s": np.zeros(count),
        "fallback": np.full(count, "", dtype="U24"),
        "reason": np.full(count, "", dtype="U80"),
        "monitor": np.full(count, "nominal", dtype="U12"),
        "y_tilde_bound_m_s": np.full((count, 3), 0.16),
        "sigma_bound": np.full((count, 3), 16.0),
    }
    return Said(**(fields | changes))


def story(*, messages=(), phases=None, data=None, said=None, **ticks):
    """A flight around the circle, 20 mm off to the east; times of the log are 3 s later."""
    data = make_flight(offset_m=(0.02, 0.0, 0.0)) if data is None else data
    data = replace(data, ticks=replace(data.ticks, **ticks)) if ticks else data
    if phases is None:
        phases = (
            Phase("connect", "the embedded shim", 0.0, 3.0),
            Phase("hover", "", 3.0, 8.0),
            Phase("track", "", 8.0, 28.0),
            Phase("land", "by the autopilot", 28.0, 33.0),
        )
    return Story(data, said_of(data.ticks, **(said or {})), tuple(messages), phases, {}, -3.0)


def message(text, severity="warning", time_s=10.0):
    return Message(time_s, severity, text)


def where(times_s, begin_s, end_s):
    return (times_s >= begin_s - 1e-6) & (times_s < end_s - 1e-6)
