"""The moving target of the autonomous modes: bounded speed and acceleration, one axis at a time."""

import math

from sitl_shim.autopilot.interface import TICK_S, EstimateStep, Motion
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Vector3

_TRAJECTORY_GAIN = 0.3
"""Approach a goal with this share of the acceleration limit (PX4's MPC_XY_TRAJ_P's default)."""
_MOST_AHEAD_M = 0.5
"""The target waits for a vehicle that cannot follow, for instance on the ground."""


class Trajectory:
    """A target that moves towards goals.

    Args:
        motion: where it starts, and how fast.
        parameters: speeds and accelerations.
    """

    __slots__ = ("_parameters", "target", "velocity")

    def __init__(self, motion: Motion, parameters: ParameterStore) -> None:
        self._parameters = parameters
        self.target: Vector3 = motion.position_enu_m
        self.velocity: Vector3 = motion.velocity_enu_m_s

    def note_reset(self, step: EstimateStep) -> None:
        """The estimate was set anew: the target goes along."""
        (x, y, z), (dx, dy, dz) = self.target, step.position_enu_m
        self.target = (x + dx, y + dy, z + dz)
        (x, y, z), (dx, dy, dz) = self.velocity, step.velocity_enu_m_s
        self.velocity = (x + dx, y + dy, z + dz)

    def stopping_point(self) -> Vector3:
        """Where the target can come to rest."""
        x, y, z = self.target
        vx, vy, vz = self.velocity
        stop_xy = 0.5 * math.hypot(vx, vy) / self._parameters["MPC_ACC_HOR"]
        stop_z = 0.5 * abs(vz) / self._parameters["MPC_ACC_DOWN_MAX"]
        return (x + vx * stop_xy, y + vy * stop_xy, z + vz * stop_z)

    def step_xy(self, goal: tuple[float, float], cruise_m_s: float) -> tuple[float, float]:
        """Move the target towards a goal at limited speed and acceleration."""
        acceleration = self._parameters["MPC_ACC_HOR"]
        x, y, z = self.target
        dx, dy = goal[0] - x, goal[1] - y
        distance = math.hypot(dx, dy)
        wanted_x = wanted_y = 0.0
        if distance > 1e-6:
            speed = min(
                cruise_m_s,
                math.sqrt(2.0 * 0.5 * acceleration * distance),
                distance / 0.5,
            )
            wanted_x, wanted_y = dx / distance * speed, dy / distance * speed
        vx, vy, vz = self.velocity
        change_x, change_y = wanted_x - vx, wanted_y - vy
        change = math.hypot(change_x, change_y)
        most = acceleration * TICK_S
        if change > most:
            change_x, change_y = change_x / change * most, change_y / change * most
        vx, vy = vx + change_x, vy + change_y
        self.velocity = (vx, vy, vz)
        self.target = (x + vx * TICK_S, y + vy * TICK_S, z)
        return self.target[0], self.target[1]

    def step_z(self, goal_z: float, motion: Motion, up_m_s: float, most_m_s: float) -> float:
        """Move the target up or down towards a goal; returns the climb rate.

        Args:
            goal_z: height to reach.
            motion: the estimate.
            up_m_s: climb rate of the way up.
            most_m_s: upper limit of the climb rate at this moment.
        """
        x, y, _ = self.target
        parameters = self._parameters
        distance = goal_z - self.target[2]
        limit = up_m_s if distance > 0.0 else parameters["MPC_Z_VEL_MAX_DN"]
        acceleration = parameters["MPC_ACC_UP_MAX" if distance > 0.0 else "MPC_ACC_DOWN_MAX"]
        wanted = math.copysign(
            min(
                limit,
                math.sqrt(2.0 * _TRAJECTORY_GAIN * acceleration * abs(distance)),
                abs(distance) / 0.5,
            ),
            distance,
        )
        rate = self.slew_z(min(wanted, most_m_s))
        z = self.target[2] + rate * TICK_S
        own = motion.position_enu_m[2]
        self.target = (x, y, min(own + _MOST_AHEAD_M, max(own - _MOST_AHEAD_M, z)))
        return rate

    def slew_z(self, wanted_m_s: float) -> float:
        """Bring the climb rate towards what is wanted; returns it."""
        vx, vy, vz = self.velocity
        up = self._parameters["MPC_ACC_UP_MAX"] * TICK_S
        down = self._parameters["MPC_ACC_DOWN_MAX"] * TICK_S
        vz = min(vz + up, max(vz - down, wanted_m_s))
        self.velocity = (vx, vy, vz)
        return vz
