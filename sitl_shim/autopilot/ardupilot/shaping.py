"""Kinematic shaping, as ArduPilot's AP_Math/control: from a goal to a target that can be flown.

The square-root controller is linear near the goal and, further away, brakes at a constant
acceleration; targets of velocity and acceleration are shaped by it with limited jerk.
"""

import math

from sitl_shim.autopilot.ardupilot.laws import sqrt_controller
from sitl_shim.autopilot.interface import TICK_S

Pair = tuple[float, float]
"""East and north."""


def shape_velocity(
    velocity_goal: float,
    acceleration_goal: float,
    velocity: float,
    acceleration: float,
    *,
    acceleration_max: float,
    jerk_max: float,
) -> float:
    """Next acceleration of a target on its way to a velocity, one axis, SI units."""
    gain = jerk_max / acceleration_max
    wanted = sqrt_controller(velocity_goal - velocity, gain, jerk_max)
    wanted = max(-acceleration_max, min(acceleration_max, wanted)) + acceleration_goal
    step = jerk_max * TICK_S
    return acceleration + max(-step, min(step, wanted - acceleration))


def shape_position(
    goal: Pair,
    state: tuple[float, float, float],
    *,
    velocity_down: float,
    velocity_up: float,
    acceleration_max: float,
    jerk_max: float,
) -> float:
    """Next acceleration of a target on its way to a position, one axis, SI units.

    Args:
        goal: position and velocity there.
        state: position, velocity and acceleration of the target now.
        velocity_down: limit of the approach, positive.
        velocity_up: limit of the approach.
        acceleration_max: to either side.
        jerk_max: to either side.
    """
    position, velocity, acceleration = state
    gain = 0.5 * jerk_max / acceleration_max
    approach = sqrt_controller(goal[0] - position, gain, 0.5 * acceleration_max)
    approach = max(-velocity_down, min(velocity_up, approach)) + goal[1]
    return shape_velocity(
        approach,
        0.0,
        velocity,
        acceleration,
        acceleration_max=acceleration_max,
        jerk_max=jerk_max,
    )


def shape_velocity_xy(
    velocity_goal: Pair,
    acceleration_goal: Pair,
    velocity: Pair,
    acceleration: Pair,
    *,
    acceleration_max: float,
    jerk_max: float,
) -> Pair:
    """As `shape_velocity`, in the horizontal plane: limits hold for the lengths."""
    gain = jerk_max / acceleration_max
    ex, ey = velocity_goal[0] - velocity[0], velocity_goal[1] - velocity[1]
    wx, wy = limit_length(_along(ex, ey, gain, jerk_max), acceleration_max)
    dx = wx + acceleration_goal[0] - acceleration[0]
    dy = wy + acceleration_goal[1] - acceleration[1]
    dx, dy = limit_length((dx, dy), jerk_max * TICK_S)
    return (acceleration[0] + dx, acceleration[1] + dy)


def shape_position_xy(
    goal: tuple[Pair, Pair, Pair],
    state: tuple[Pair, Pair, Pair],
    *,
    speed_max: float,
    acceleration_max: float,
    jerk_max: float,
) -> Pair:
    """As `shape_position`, in the horizontal plane.

    Args:
        goal: position, velocity and acceleration there.
        state: position, velocity and acceleration of the target now.
        speed_max: of the approach.
        acceleration_max: of the corrections.
        jerk_max: of the target.
    """
    (gx, gy), (gvx, gvy), acceleration_goal = goal
    (px, py), velocity, acceleration = state
    gain = 0.5 * jerk_max / acceleration_max
    vx, vy = limit_length(_along(gx - px, gy - py, gain, 0.5 * acceleration_max), speed_max)
    return shape_velocity_xy(
        (vx + gvx, vy + gvy),
        acceleration_goal,
        velocity,
        acceleration,
        acceleration_max=acceleration_max,
        jerk_max=jerk_max,
    )


def limit_length(vector: Pair, longest: float) -> Pair:
    """The vector, cut to a length."""
    x, y = vector
    length = math.hypot(x, y)
    if length <= longest:
        return vector
    return (x * longest / length, y * longest / length)


def _along(x: float, y: float, gain: float, acceleration_max: float) -> Pair:
    length = math.hypot(x, y)
    if length < 1e-12:
        return (0.0, 0.0)
    rate = sqrt_controller(length, gain, acceleration_max) / length
    return (x * rate, y * rate)
