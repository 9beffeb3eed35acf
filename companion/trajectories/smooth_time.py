"""Time ramps with three continuous derivatives, for starting and stopping without a jolt."""

import numpy as np

from companion.trajectories.trajectory import Array

RAMP_S = 2.0
"""Length of the ramp of `ramped`, s."""


def step7(x: Array) -> tuple[Array, Array, Array]:
    """The smooth step 35x⁴ - 84x⁵ + 70x⁶ - 20x⁷ on [0, 1], held outside, and two derivatives."""
    x = np.clip(x, 0.0, 1.0)
    value = x**4 * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)))
    first = 140.0 * x**3 * (1.0 - x) ** 3
    second = 420.0 * x**2 * (1.0 - x) ** 2 * (1.0 - 2.0 * x)
    return value, first, second


def _ramp_up(t: Array) -> tuple[Array, Array, Array]:
    """s(t) = 2 (7x⁵ - 14x⁶ + 10x⁷ - 2.5x⁸) + max(t - 2, 0), x = clip(t/2, 0, 1)."""
    x = np.clip(t / RAMP_S, 0.0, 1.0)
    value = RAMP_S * x**5 * (7.0 + x * (-14.0 + x * (10.0 - 2.5 * x)))
    value = value + np.maximum(t - RAMP_S, 0.0)
    rate, curvature, _ = step7(x)
    return value, rate, np.where(t < RAMP_S, curvature / RAMP_S, 0.0)


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
    total = float(_ramp_up(np.array(stop_s))[0]) + float(_ramp_up(np.array(RAMP_S))[0])
    down = _ramp_up(stop_s + RAMP_S - times)
    after = times > stop_s
    return (
        np.where(after, total - down[0], up[0]),
        np.where(after, down[1], up[1]),
        np.where(after, -down[2], up[2]),
    )
