"""Frames and messages of an invented flight, for the page without a flight behind it."""

import math

BEGIN_S, TRACK_S, END_S = 4.0, 8.0, 30.0
STEP_S = 0.05


def path(t):
    """Figure-eight, 2 m by 1 m, at about 1.2 m."""
    return [2 * math.sin(0.5 * t), math.sin(t), 1.2 + 0.2 * math.sin(0.3 * t)]


def flight(mode="live", commands=True, ended=False):
    return {
        "mode": mode,
        "title": "traj-4 with the fan",
        "commands": commands,
        "trajectory": "traj-4",
        "controller": "mpc-l1",
        "vehicle": "bebop2",
        "autopilot": "px4",
        "wind": "fan-4",
        "seed": 1,
        "duration_s": END_S if ended else None,
        "scored_s": [TRACK_S, END_S] if ended else None,
        "result": {"outcome": "landed", "mean_error_mm": 23.4} if ended else None,
        "limits": {"tilt_deg": 35.0, "latency_ms": 5.0, "state_age_ms": 100.0},
        "scene": {
            "geofence": {"low_enu_m": [-4, -3, 0], "high_enu_m": [4, 3, 3]},
            "desired_enu_m": [path(0.05 * i) for i in range(252)],
            "fans": [
                {
                    "position_enu_m": [-2.3, 0.4, 1.0],
                    "direction_enu": [0.958, 0.287, 0.0],
                    "half_angle_deg": 12.0,
                    "range_m": 3.0,
                }
            ],
            "arm_m": 0.17,
            "horizon_s": 0.9,
        },
    }


def frame(t):
    """What the page is told of the time t."""
    tracking = t >= TRACK_S
    s = max(0.0, t - TRACK_S)
    away = 0.02 * math.sin(3 * t), 0.015 * math.cos(2 * t), 0.008 * math.sin(t)
    desired = path(s)
    position = [a + b for a, b in zip(desired, away, strict=True)]
    position[2] *= min(1.0, max(0.0, (t - BEGIN_S) / (TRACK_S - BEGIN_S)))
    roll, pitch = 0.12 * math.sin(s), 0.15 * math.cos(0.5 * s)
    gust = math.exp(-(((position[0] + 0.9) / 0.5) ** 2))
    only = tracking or None
    return {
        "t": t,
        "phase": "track" if tracking else "take off" if t >= BEGIN_S else "connect",
        "mode": "OFFBOARD" if tracking else "AUTO_TAKEOFF",
        "armed": t >= BEGIN_S,
        "position": position,
        "velocity": [math.cos(0.5 * s), math.cos(s), 0.0],
        "attitude": [math.cos(roll / 2) * math.cos(pitch / 2), roll / 2, pitch / 2, 0.0],
        "desired": only and desired,
        "preview": only and [path(s + 0.06 * i) for i in range(15)],
        "plan_end": only and path(s + 0.9),
        "truth": position,
        "push": only and [1.3 * gust, 0.4 * gust, 0.0],
        "error_mm": only and 1000 * math.hypot(*away),
        "tilt_deg": math.degrees(math.hypot(roll, pitch)),
        "thrust": 0.5 + 0.03 * math.sin(2 * t),
        "y_tilde": only
        and [0.02 * math.sin(9 * t), 0.015 * math.sin(7 * t), 0.01 * math.cos(5 * t)],
        "y_tilde_bound": only and [0.05, 0.05, 0.06],
        "sigma": only and [0.1 * gust, 0.03 * gust, 0.2 * math.sin(t)],
        "sigma_bound": only and [0.61, 0.61, 4.0],
        "computed_us": 650 + 200 * math.sin(40 * t) ** 2,
        "state_age_ms": 10 + 3 * math.sin(17 * t),
        "latency_ms": 0.9 + 0.4 * math.sin(23 * t) ** 2,
        "rung": "track",
        "fallback": "",
        "monitor": "nominal" if tracking else "",
        "controller": "mpc-l1" if tracking else "",
        "battery_percent": 96 - t / 3,
        "missed_deadlines": 0,
    }


def frames(until_s=END_S):
    return [frame(round(i * STEP_S, 3)) for i in range(1, round(until_s / STEP_S) + 1)]


MESSAGES = [
    {"t": 0.1, "severity": "info", "text": "phase connect: udp"},
    {"t": 4.0, "severity": "info", "text": "phase take off: to 1.2 m"},
    {"t": 8.0, "severity": "info", "text": "phase track: traj-4"},
    {"t": 12.0, "severity": "warning", "text": "the plan's bound on r is active"},
    {"t": 20.0, "severity": "error", "text": "no state for 120 ms: level"},
]
