"""What setpoints do: their echo, tilt, heading and climb."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tests.sitl_shim.captures.conversation import Capture, Conversation
from tests.sitl_shim.captures.ids import (
    ATTITUDE_QUATERNION,
    ATTITUDE_TARGET,
    COMMAND_LONG,
    HEARTBEAT,
    POSITION,
    SET_ATTITUDE_TARGET,
)
from tests.sitl_shim.captures.sequences import Comparison

_AFTER_S = (0.0, 1.0, 4.0)
"""When an effect is looked at, after the last setpoint of a run: a time-out shows later."""
_SHORTEST_RUN_S = 0.9
_HEARTBEAT_S = 1.1


def effects(capture: Capture, ours: Conversation) -> Comparison:
    """What each run of setpoints does at its end, and after it while nothing else is said."""
    limits = _LIMITS[capture.name.partition("-")[0]]
    compared, found = 0, []
    for run in _runs(capture):
        for after_s in _AFTER_S:
            if not _is_comparable(capture, run, after_s):
                continue
            real, shim = (_state(side, run.end_s + after_s) for side in (capture.vehicle, ours))
            later = f", {after_s:g} s after" if after_s else ""
            for what in sorted(real.keys() & shim.keys()):
                compared += 1
                off = abs(_difference(what, real[what], shim[what]))
                if off > limits[what](real[what]):
                    found.append(f"{run.label}{later}: {what} differs by {off:.2g}")
    return Comparison(compared, found)


_FOLLOWING = (0x00060000, 4)
"""PX4's OFFBOARD, ArduPilot's GUIDED."""


def _commanded_climb_limit(real_m_s: float) -> float:
    """ArduPilot holds a climb rate, PX4 (and ArduPilot on a throttle) a thrust alone."""
    return 0.15 if abs(real_m_s) < 0.2 else 0.03 + 0.15 * abs(real_m_s)


_ECHOES: Mapping[str, Callable[[float], float]] = {
    "echoed thrust": lambda _: 0.06,
    "tilt (°)": lambda _: 1.0,
    "echoed tilt (°)": lambda _: 1.5,
    "echoed yaw rate (rad/s)": lambda _: 0.16,
    "heading (°)": lambda _: 5.0,
}
_LIMITS: Mapping[str, Mapping[str, Callable[[float], float]]] = {
    "px4": {**_ECHOES, "climb (m/s)": lambda _: 0.4},
    "ardupilot": {**_ECHOES, "climb (m/s)": _commanded_climb_limit},
}
"""By flavour and effect: how far the shim may be from what the real one did."""


@dataclass
class _Run:
    """Setpoints that stayed the same for a while."""

    begin_s: float
    end_s: float
    label: str
    next_s: float = math.inf
    """When a client said something else that moves the vehicle."""


def _runs(capture: Capture) -> list[_Run]:
    runs: list[_Run] = []
    for said in capture.clients:
        if said.frame.message_id not in (COMMAND_LONG, SET_ATTITUDE_TARGET):
            continue
        is_setpoint = said.frame.message_id == SET_ATTITUDE_TARGET
        label = _label(said.message) if is_setpoint else ""
        if runs and runs[-1].label == label and said.time_s - runs[-1].end_s <= 0.5:
            runs[-1].end_s = said.time_s
            continue
        if runs:
            runs[-1].next_s = said.time_s
        runs.append(_Run(said.time_s, said.time_s, label))
    return [run for run in runs if run.label and run.end_s - run.begin_s > _SHORTEST_RUN_S]


def _label(setpoint: Any) -> str:
    """What is asked for, as far as it makes a difference."""
    norm = math.hypot(*setpoint.q)
    rates = (setpoint.body_roll_rate, setpoint.body_pitch_rate, setpoint.body_yaw_rate)
    parts = [
        f"mask {setpoint.type_mask}",
        f"thrust {setpoint.thrust:.2g}",
        f"tilt {_tilt_deg(setpoint.q):.0f}°",
    ]
    if norm > 0.0 and abs(norm - 1.0) > 1e-3:
        parts.append(f"norm {norm:.2f}")
    if any(rates):
        parts.append(f"rates {tuple(round(rate, 2) for rate in rates)}")
    return ", ".join(parts)


def _is_comparable(capture: Capture, run: _Run, after_s: float) -> bool:
    """Whether the real vehicle followed the run, and nothing came between then and now."""
    at_s = run.end_s + after_s
    if not after_s:
        return _follows(capture, at_s)
    alone = at_s < min(run.next_s, capture.vehicle.ends_s)
    # A failsafe's mode may have come since the last heartbeat.
    return alone and _follows(capture, at_s) and _follows(capture, at_s + _HEARTBEAT_S)


def _follows(capture: Capture, time_s: float) -> bool:
    """Whether the real vehicle's last heartbeat told a mode that follows setpoints."""
    heard = capture.vehicle.last(HEARTBEAT, time_s)
    return heard is not None and heard.message.custom_mode in _FOLLOWING


def _state(side: Conversation, time_s: float) -> dict[str, float]:
    """What is known of a moment, by effect."""

    def last(number: int) -> Any:
        said = side.last(number, time_s - 0.05)
        return said.message if said and said.time_s >= time_s - 0.5 else None

    attitude, target = last(ATTITUDE_QUATERNION), last(ATTITUDE_TARGET)
    position = last(POSITION)
    found = {}
    if attitude is not None:
        q = (attitude.q1, attitude.q2, attitude.q3, attitude.q4)
        found["tilt (°)"] = _tilt_deg(q)
        found["heading (°)"] = _heading_deg(q)
    if position is not None:
        found["climb (m/s)"] = -position.vz
    if target is not None:
        found["echoed thrust"] = target.thrust
        found["echoed tilt (°)"] = _tilt_deg(target.q)
        found["echoed yaw rate (rad/s)"] = target.body_yaw_rate
    return found


def _difference(what: str, real: float, shim: float) -> float:
    if what == "heading (°)":
        return (shim - real + 180.0) % 360.0 - 180.0
    return shim - real


def _heading_deg(q: Sequence[float]) -> float:
    w, x, y, z = q
    return math.degrees(math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def _tilt_deg(q: Sequence[float]) -> float:
    norm = math.fsum(c * c for c in q)
    if not norm > 0.0:
        return 0.0
    cosine = 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2]) / norm
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
