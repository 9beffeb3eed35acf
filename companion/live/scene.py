"""What stands still on the page: who flies what, where the bounds lie, where the fans stand."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from yaml import YAMLError

from companion.config.resolve import FlightConfig
from companion.config.yaml_source import ConfigError, read_yaml
from companion.flight.embedded_shim import scenario_path
from companion.flight.setpoints.timeline import Timeline, Track
from companion.flight.setpoints.timing import DEADLINE_S
from companion.frames import Vector3

_MOST_POINTS = 400
_ARM_M = 0.17
"""Of the vehicle that is drawn: no vehicle's file says how large it is."""
_FAN_RANGE_M = 4.0
_HALF_ANGLE_DEG = 12.0
"""Of a fan's cone where the jet's width at its distance says no more."""


def flight_object(
    config: FlightConfig | None,
    mode: str,
    *,
    autopilot: str | None = None,
    duration_s: float | None = None,
    result: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The page's Flight (docs/live.md), before anything of the way is known.

    Args:
        config: mission, vehicle, controller; None if the log does not say.
        mode: "live" or "recorded".
        autopilot: px4 or ardupilot, if that is known.
        duration_s: of a flight that is over.
        result: what `result.json` says.
    """
    mission = None if config is None else config.mission
    simulated = mission is not None and mission.connect is None
    return {
        "mode": mode,
        "title": _title(config, autopilot),
        "commands": mode == "live",
        "trajectory": "" if mission is None else str(mission.trajectory),
        "controller": "" if mission is None else str(mission.controller),
        "vehicle": "" if mission is None else str(mission.vehicle),
        "autopilot": autopilot,
        "wind": str(mission.wind) if mission is not None and simulated else None,
        "seed": mission.seed if mission is not None and simulated else None,
        "duration_s": duration_s,
        "scored_s": None,
        "result": None if result is None else short_result(result),
        "limits": {
            "tilt_deg": None if config is None else config.vehicle.tilt_limit_deg,
            "latency_ms": DEADLINE_S * 1e3,
            "state_age_ms": None if mission is None else mission.supervisor.state_age_limit_s * 1e3,
        },
        "scene": {
            "geofence": None,
            "desired_enu_m": None,
            "fans": [] if config is None else _fans(config),
            "arm_m": _ARM_M,
            "horizon_s": horizon_s(config),
        },
    }


def short_result(result: Mapping[str, Any]) -> dict[str, Any]:
    """What the page says of a flight that is over, from `result.json`."""
    mean = result.get("mean_tracking_error_m")
    return {
        "outcome": result.get("outcome"),
        "note": result.get("note") or "",
        "mean_error_mm": None if mean is None else mean * 1e3,
        "missed_deadlines": result.get("missed_deadlines"),
    }


def horizon_s(config: FlightConfig | None) -> float:
    """How far ahead the outer controller looks, s; 0 for one that does not."""
    mpc = None if config is None else config.controller.mpc
    return 0.0 if mpc is None else mpc.horizon * mpc.period_s


def geofence(config: FlightConfig, anchor_enu_m: Sequence[float]) -> dict[str, Any]:
    """The box where it lies in the world."""
    fence = config.mission.geofence
    return {
        "low_enu_m": [a + b for a, b in zip(anchor_enu_m, fence.low_m, strict=True)],
        "high_enu_m": [a + b for a, b in zip(anchor_enu_m, fence.high_m, strict=True)],
    }


def desired_path(timeline: Timeline) -> list[Vector3] | None:
    """The tracked part, ENU m; None if there is none."""
    for segment in timeline.segments:
        if isinstance(segment, Track):
            times = np.linspace(0.0, segment.trajectory.end_s, _MOST_POINTS)
            points: list[Vector3] = np.round(segment.position(times), 4).tolist()
            return points
    return None


def _title(config: FlightConfig | None, autopilot: str | None) -> str:
    if config is None:
        return "a flight"
    mission = config.mission
    name = mission.trajectory
    under = f" under {autopilot}" if autopilot else ""
    title = f"Trajectory {name}, {mission.controller}, {mission.vehicle}{under}"
    if mission.connect is None:
        title += f", wind {mission.wind}, seed {mission.seed}"
    return title


def _fans(config: FlightConfig) -> list[dict[str, Any]]:
    """The jets of the scenario's file, if it is still there."""
    if config.mission.connect is not None:
        return []
    try:
        scenario = read_yaml(scenario_path(config.mission)).data
    except (ConfigError, OSError, YAMLError):
        return []
    winds = scenario.get("winds", ()) if isinstance(scenario, Mapping) else ()
    return [fan for wind in winds if (fan := _fan(wind)) is not None]


def _fan(wind: object) -> dict[str, Any] | None:
    """A fan stands some way upstream of where its axis crosses the path."""
    if not isinstance(wind, Mapping) or wind.get("kind") != "jet":
        return None
    try:
        direction = np.array(wind["direction_enu"], dtype=float)
        direction /= np.linalg.norm(direction)
        crossing = np.array(wind["crossing_enu_m"], dtype=float)
        distance = float(wind["fan_distance_m"])
        angle = math.degrees(math.atan2(float(wind["width_m"]), distance))
    except (KeyError, TypeError, ValueError):
        return None
    return {
        "position_enu_m": (crossing - distance * direction).tolist(),
        "direction_enu": direction.tolist(),
        "half_angle_deg": angle if math.isfinite(angle) else _HALF_ANGLE_DEG,
        "range_m": _FAN_RANGE_M,
    }
