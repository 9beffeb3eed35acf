"""Whether a trajectory fits a vehicle and a geofence, before anything is armed."""

from dataclasses import dataclass

import numpy as np

from companion.trajectories.trajectory import Trajectory


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """What a desired motion must stay within."""

    speed_m_s: float
    acceleration_m_s2: float
    box_low_m: tuple[float, float, float]
    box_high_m: tuple[float, float, float]


def problems_of(trajectory: Trajectory, limits: MotionLimits) -> list[str]:
    """Sentences on what does not fit: time, figure, limit and remedy; empty if all fits."""
    times = np.arange(0.0, trajectory.end_s + 0.01, 0.01)
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
    low, high = np.array(limits.box_low_m), np.array(limits.box_high_m)
    outside = np.maximum(low - motion.position_m, motion.position_m - high)
    sample, axis = np.unravel_index(int(np.argmax(outside)), outside.shape)
    if outside[sample, axis] > 0.0:
        where = ", ".join(f"{c:.2f}" for c in motion.position_m[sample])
        found.append(
            f"trajectory '{trajectory.name}' leaves the geofence at t = {times[sample]:.2f} s: "
            f"({where}) m is {outside[sample, axis]:.2f} m outside on {'xyz'[axis]}, where "
            f"{low[axis]:g} … {high[axis]:g} m is allowed. Move the origin, or widen "
            "`geofence` in the mission."
        )
    return found
