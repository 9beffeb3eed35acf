"""Whether a trajectory fits a vehicle and a geofence, before anything is armed."""

from dataclasses import dataclass

import numpy as np

from companion.trajectories.trajectory import Array, Trajectory


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """What a desired motion must stay within."""

    speed_m_s: float
    acceleration_m_s2: float


@dataclass(frozen=True, slots=True)
class Fence:
    """A box that a desired position must stay within, in the trajectory's frame."""

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]


def problems_of(trajectory: Trajectory, limits: MotionLimits) -> list[str]:
    """Sentences on what does not fit: time, figure, limit and remedy; empty if all fits."""
    times = _times(trajectory)
    motion = trajectory.motion(times)
    found: list[str] = []
    for what, values, limit, unit in (
        ("a speed", motion.velocity_m_s, limits.speed_m_s, "m/s"),
        ("an acceleration", motion.acceleration_m_s2, limits.acceleration_m_s2, "m/s²"),
    ):
        size = np.linalg.norm(values, axis=1)
        worst = int(np.argmax(size))
        if not size[worst] <= limit:  # NaN does not fit either
            found.append(
                f"trajectory '{trajectory.name}' needs {what} of {size[worst]:.2f} {unit} at "
                f"t = {times[worst]:.2f} s, the vehicle's limit is {limit:g} {unit}. Fly it "
                "slower, or raise the limit in the vehicle's file if the vehicle can do it."
            )
    return found


def fence_problems_of(trajectory: Trajectory, fence: Fence) -> list[str]:
    """A sentence on where a trajectory leaves a box; empty if it stays inside."""
    times = _times(trajectory)
    position = trajectory.position(times)
    low, high = np.array(fence.low_m), np.array(fence.high_m)
    outside = np.maximum(low - position, position - high)
    sample, axis = np.unravel_index(int(np.argmax(outside)), outside.shape)
    if outside[sample, axis] <= 0.0:
        return []
    where = ", ".join(f"{c:.2f}" for c in position[sample])
    return [
        (
            f"trajectory '{trajectory.name}' leaves the geofence at t = {times[sample]:.2f} s: "
            f"({where}) m is {outside[sample, axis]:.2f} m outside on {'xyz'[axis]}, where "
            f"{low[axis]:g} … {high[axis]:g} m is allowed. Move the origin, or widen "
            "`geofence` in the mission."
        )
    ]


def _times(trajectory: Trajectory) -> Array:
    times: Array = np.arange(0.0, trajectory.end_s + 0.01, 0.01)
    return times
