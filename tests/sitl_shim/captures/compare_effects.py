"""What setpoints do: their echo, tilt, turn and climb."""

import math
from collections.abc import Mapping, Sequence
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

_DO_SET_MODE = 176


def effects(capture: Capture, ours: Conversation) -> list[str]:
    """What each run of setpoints does: its echo, tilt, turn and climb at the end of the run."""
    found = []
    for _, end_s, setpoint in _runs(capture):
        mask, thrust = setpoint[0], setpoint[-1]
        label = f"mask {mask}, thrust {thrust:g}, {setpoint[1]}"
        real, shim = (_state_at(side, end_s) for side in (capture.vehicle, ours))
        if real is None or shim is None or not _follows(capture, end_s):
            continue
        for what, limit in _EFFECTS.items():
            if abs(real[what] - shim[what]) > limit:
                found.append(f"{label}: {what} differs")
    return found


_FOLLOWING = (0x00060000, 4)
"""PX4's OFFBOARD, ArduPilot's GUIDED."""
_EFFECTS: Mapping[str, float] = {
    "thrust echoed": 0.06,
    "tilt, °": 3.0,
    "tilt echoed, °": 3.0,
    "yaw rate echoed, rad/s": 0.15,
    "climb, m/s": 0.7,
}


def _follows(capture: Capture, time_s: float) -> bool:
    """Whether the real vehicle was in a mode that follows setpoints."""
    heard = [m for t, m in capture.vehicle.messages(HEARTBEAT) if t < time_s]
    return bool(heard) and heard[-1].custom_mode in _FOLLOWING


def _runs(capture: Capture) -> list[tuple[float, float, tuple[Any, ...]]]:
    """(begin, end, setpoint) of setpoints that stayed the same for a second."""
    runs: list[list[Any]] = []
    for said in capture.clients:
        if said.frame.message_id == COMMAND_LONG and said.message.command == _DO_SET_MODE and runs:
            # Another mode, another effect: a run ends with it.
            runs.append([said.time_s, said.time_s, None])
        if said.frame.message_id != SET_ATTITUDE_TARGET:
            continue
        m = said.message
        rates = tuple(round(r, 2) for r in (m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate))
        tilt = round(math.degrees(_tilt(m.q)) / 2.0) * 2
        key = (m.type_mask, f"tilt {tilt}°, rates {rates}", round(m.thrust, 2))
        if not runs or runs[-1][2] != key or said.time_s - runs[-1][1] > 0.5:
            runs.append([said.time_s, said.time_s, key])
        runs[-1][1] = said.time_s
    return [(begin, end, key) for begin, end, key in runs if key and end - begin > 1.0]


def _state_at(side: Conversation, time_s: float) -> dict[str, float] | None:
    def last(number: int) -> Any:
        before = [s for s in side.frames(number) if time_s - 0.5 <= s.time_s <= time_s - 0.05]
        return before[-1].message if before else None

    attitude, position, target = last(ATTITUDE_QUATERNION), last(POSITION), last(ATTITUDE_TARGET)
    if attitude is None or position is None or target is None:
        return None
    return {
        "thrust echoed": target.thrust,
        "tilt, °": math.degrees(_tilt((attitude.q1, attitude.q2, attitude.q3, attitude.q4))),
        "tilt echoed, °": math.degrees(_tilt(target.q)),
        "yaw rate echoed, rad/s": target.body_yaw_rate,
        "climb, m/s": -position.vz,
    }


def _tilt(q: Sequence[float]) -> float:
    norm = math.fsum(c * c for c in q)
    if not norm > 0.0:
        return 0.0
    return math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2]) / norm)))
