"""Time ramps with three continuous derivatives, for starting and stopping without a jolt."""

from typing import TypeVar

import numpy as np

from companion.trajectories.trajectory import Array

_Value = TypeVar("_Value", float, Array)

RAMP_S = 2.0
"""Length of the ramp of `ramped`, s."""


def smooth_step7(x: Array) -> Array:
    """The smooth step 35x⁴ - 84x⁵ + 70x⁶ - 20x⁷ on [0, 1], held outside."""
    value: Array = _step7(np.minimum(np.maximum(x, 0.0), 1.0))
    return value


def smooth_step7_at(x: float) -> float:
    """`smooth_step7` of one number."""
    return _step7(min(max(x, 0.0), 1.0))


def _step7(x: _Value) -> _Value:
    square = x * x
    return square * square * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)))


def step7(x: Array) -> tuple[Array, Array, Array]:
    """The smooth step (`smooth_step7`) and two derivatives."""
    value = smooth_step7(x)
    x = np.clip(x, 0.0, 1.0)
    first = 140.0 * x**3 * (1.0 - x) ** 3
    second = 420.0 * x**2 * (1.0 - x) ** 2 * (1.0 - 2.0 * x)
    return value, first, second


def _ramp_up_time(t: Array) -> Array:
    """s(t) = 2 (7x⁵ - 14x⁶ + 10x⁷ - 2.5x⁸) + max(t - 2, 0), x = clip(t/2, 0, 1)."""
    time: Array = _ramp(np.minimum(np.maximum(t / RAMP_S, 0.0), 1.0))
    time += np.maximum(t - RAMP_S, 0.0)
    return time


def _ramp_up_time_at(t: float) -> float:
    return _ramp(min(max(t / RAMP_S, 0.0), 1.0)) + max(t - RAMP_S, 0.0)


def _ramp(x: _Value) -> _Value:
    square = x * x
    return (RAMP_S * x) * (square * square) * (7.0 + x * (-14.0 + x * (10.0 - 2.5 * x)))


def _ramp_up(t: Array) -> tuple[Array, Array, Array]:
    """`_ramp_up_time` and two derivatives."""
    rate, curvature, _ = step7(t / RAMP_S)
    return _ramp_up_time(t), rate, np.where(t < RAMP_S, curvature / RAMP_S, 0.0)


def ramped_time(times_s: Array, stop_s: float) -> Array:
    """Path time s(t) of `ramped` alone."""
    times = np.asarray(times_s, dtype=float)
    if not times.size:
        return times.copy()
    first, last = float(times[times.argmin()]), float(times[times.argmax()])
    if first >= RAMP_S and last <= stop_s:
        even: Array = times - (RAMP_S - 1.0)
        return even
    up = _ramp_up_time(times)
    if not last > stop_s:
        return up
    stopped: Array = np.where(times > stop_s, _stopping_time(times, stop_s), up)
    return stopped


def ramped_time_at(time_s: float, stop_s: float) -> float:
    """`ramped_time` of one time."""
    if time_s > stop_s:
        return _ramp_up_time_at(stop_s) + 1.0 - _ramp_up_time_at(stop_s + RAMP_S - time_s)
    return _ramp_up_time_at(time_s)


def _stopping_time(times_s: Array, stop_s: float) -> Array:
    """s(t) after `stop_s`: the ramp, run backwards."""
    time: Array = _ramp_up_time_at(stop_s) + 1.0 - _ramp_up_time(stop_s + RAMP_S - times_s)
    return time


def ramped(times_s: Array, stop_s: float) -> tuple[Array, Array, Array]:
    """Path time s(t) that starts smoothly at 0, runs at rate 1, and stops smoothly after `stop_s`.

    Up to ``stop_s`` this is the ramped time of the five test trajectories; from there on it is
    slowed down by the same ramp, run backwards, and rests from ``stop_s + 2`` on.

    Returns:
        s (s), s' and s'' (1/s), shaped as the times.
    """
    times = np.asarray(times_s, dtype=float)
    up = _ramp_up(times)
    if not (times > stop_s).any():
        return up
    down = _ramp_up(stop_s + RAMP_S - times)
    after = times > stop_s
    return (
        np.where(after, _stopping_time(times, stop_s), up[0]),
        np.where(after, down[1], up[1]),
        np.where(after, -down[2], up[2]),
    )
