"""The recording of an identification flight, from what its log holds."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, Literal, cast

import numpy as np

from companion.frames import euler_from_quaternion
from companion.identification.estimates import UnidentifiedError
from companion.identification.recording import Array, Recording
from companion.thrust_meaning import ThrustMeaning

_NAMED = re.compile("'([a-z]+)'")
_WITHOUT_CONTROLLER = ("silence",)


def recording_from_records(
    control: Sequence[Mapping[str, Any]],
    thrust_reports: Sequence[Mapping[str, Any]],
    experiment: Sequence[Mapping[str, Any]],
) -> Recording:
    """The rows of the timetable: what was played, and the pauses.

    Args:
        control: records of the channel `control`, of the log or as they were made.
        thrust_reports: of `thrust_report`; none where the autopilot reports no thrust.
        experiment: of `experiment`; the last counts.

    Raises:
        UnidentifiedError: this is no identification flight's log, or it never came to anything.
    """
    if not experiment:
        raise UnidentifiedError(
            "The log has no record of an experiment: only the flights of `companion identify` can "
            "be identified from."
        )
    facts = experiment[-1]
    played = [
        record
        for record in control
        if record["segment"] and record["phase"] not in _WITHOUT_CONTROLLER and _whole(record)
    ]
    newest: list[Mapping[str, Any]] = []
    for record in played:
        if not newest or record["autopilot_time_s"] > newest[-1]["autopilot_time_s"]:
            newest.append(record)
    if not newest:
        raise UnidentifiedError("The flight ended before anything was played. Fly it again.")

    def numbers(key: str) -> Array:
        return np.array([_number(r[key]) for r in newest], dtype=float)

    def rows(key: str) -> Array:
        return np.array([[_number(c) for c in r[key]] for r in newest], dtype=float)

    time_s = numbers("autopilot_time_s")
    attitude = rows("attitude_flu_to_enu")
    return Recording(
        time_s=time_s,
        received_s=numbers("received_s"),
        loop_delay_s=numbers("loop_delay_s"),
        position_enu_m=rows("position_enu_m"),
        velocity_enu_m_s=rows("velocity_enu_m_s"),
        attitude_flu_to_enu=attitude,
        rate_flu_rad_s=rows("rate_flu_rad_s"),
        roll_rad=numbers("roll_rad"),
        pitch_rad=numbers("pitch_rad"),
        yaw_rad=np.array([_yaw_rad(r["attitude_setpoint_flu_to_enu"]) for r in newest]),
        thrust=numbers("thrust"),
        reported_thrust=_reported(thrust_reports, facts, time_s, attitude),
        climb_rate_m_s=rows("applied_u")[:, 2],
        segment=np.array([str(r["segment"]) for r in newest], dtype=str),
        thrust_meaning=ThrustMeaning(
            cast("Literal['collective', 'vertical', 'climb_rate']", facts["thrust_kind"]),
            float(facts["thrust_climb_m_s"]),
            float(facts["thrust_descent_m_s"]),
        ),
        autopilot=str(facts["autopilot"]),
        left=_left(newest),
    )


def _left(records: Sequence[Mapping[str, Any]]) -> tuple[tuple[str, str], ...]:
    """Parts that were left, each time once; a log of an earlier release does not tell."""
    sentences = dict.fromkeys(str(r.get("left") or "") for r in records)
    return tuple((_NAMED.findall(left)[0], left) for left in sentences if _NAMED.search(left))


def _reported(
    reports: Sequence[Mapping[str, Any]],
    facts: Mapping[str, Any],
    time_s: Array,
    attitude: Array,
) -> Array:
    """(n,) thrust along the body's vertical that was reported last before each sample.

    ArduPilot reports it before it divides by the tilt's cosine, PX4 after the sender has.
    """
    at = np.array([float(r["autopilot_time_s"]) for r in reports])
    thrust = np.array([float(r["thrust"]) for r in reports])
    if not len(at):
        return np.full(len(time_s), math.nan)
    order = np.argsort(at, kind="stable")
    at, thrust = at[order], thrust[order]
    index = np.searchsorted(at, time_s, side="right") - 1
    found = np.where(index >= 0, thrust[np.clip(index, 0, None)], math.nan)
    if facts["autopilot"] == "ardupilot" and facts["thrust_kind"] != "collective":
        _, x, y, _ = attitude.T
        found = found / np.maximum(0.5, 1.0 - 2.0 * (x * x + y * y))
    return np.asarray(found, dtype=float)


def _whole(record: Mapping[str, Any]) -> bool:
    """True if a setpoint of the stack went out on it: nothing of it is missing."""
    values = [record["roll_rad"], record["pitch_rad"], record["thrust"]]
    values += [*record["position_enu_m"], *record["velocity_enu_m_s"]]
    values += [*record["attitude_flu_to_enu"], *record["attitude_setpoint_flu_to_enu"]]
    return record["rung"] == "track" and all(math.isfinite(_number(v)) for v in values)


def _number(value: float | None) -> float:
    """A value of a log, in which what is not finite is null."""
    return math.nan if value is None else value


def _yaw_rad(attitude: Sequence[float]) -> float:
    w, x, y, z = attitude
    return euler_from_quaternion((w, x, y, z))[2]
