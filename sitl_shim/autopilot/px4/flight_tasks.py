"""What the autonomous modes do: where to be next, for take-off, hold, land, return, descend."""

import math
from collections.abc import Callable

from sitl_shim.autopilot.interface import TICK_S, Motion
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.modes import Mode
from sitl_shim.autopilot.px4.position_control import TrajectorySetpoint, heading_of
from sitl_shim.frames import Vector3

_TRAJECTORY_GAIN = 0.3
"""Approach a goal with this share of the acceleration limit (PX4's MPC_XY_TRAJ_P's default)."""

_OFF_THE_GROUND_M = 0.05
_LIFT_OFF_RATE_M_S = 0.2
_TAKEOFF_ACCELERATION_M_S2 = 0.4
"""As gentle as PX4 was measured: 2.5 m in 6 to 8 s, the spool-up included."""


class FlightTask:
    """The setpoint generator of one stay in an autonomous mode.

    Made when the mode is entered, so that it starts from where the vehicle is and how it moves.

    Args:
        mode: AUTO_TAKEOFF, AUTO_LOITER, AUTO_LAND, AUTO_RTL; any other mode descends blindly,
            level and without position, which is what a mode for sticks does without sticks.
        motion: the estimate at entry.
        parameters: speeds and accelerations.
        goal_z_m: altitude to climb to (take-off), in the local frame.
        home_enu_m: where to return to.
        previous: a task whose goal is kept (holding what a take-off has reached).
    """

    __slots__ = (
        "_goal_xy",
        "_goal_z",
        "_home",
        "_landing",
        "_make",
        "_parameters",
        "_start_z",
        "_target",
        "_velocity",
        "_yaw",
        "descending",
        "mode",
    )

    def __init__(
        self,
        mode: Mode,
        motion: Motion,
        parameters: ParameterStore,
        *,
        goal_z_m: float,
        home_enu_m: Vector3,
        previous: "FlightTask | None" = None,
    ) -> None:
        self.mode = mode
        self.descending = False
        self._parameters = parameters
        self._home = home_enu_m
        self._yaw = heading_of(motion.attitude_flu_to_enu)
        x, y, z = self._target = motion.position_enu_m
        self._start_z = z
        vx, vy, vz = self._velocity = motion.velocity_enu_m_s
        self._landing = False
        speed = math.hypot(vx, vy)
        stop_xy = 0.5 * speed / parameters["MPC_ACC_HOR"]
        stop_z = 0.5 * abs(vz) / parameters["MPC_ACC_DOWN_MAX"]
        self._goal_xy = (x + vx * stop_xy, y + vy * stop_xy)
        self._goal_z = z + vz * stop_z
        self._make: Callable[[Motion], TrajectorySetpoint] = self._go
        if previous is not None:
            self._goal_xy, self._goal_z = previous._goal_xy, previous._goal_z
            self._target, self._velocity = previous._target, previous._velocity
            self._yaw = previous._yaw
        if mode is Mode.AUTO_TAKEOFF:
            self._goal_xy = (x, y)
            self._goal_z = max(z, goal_z_m)
            self._velocity = (0.0, 0.0, 0.0)
        elif mode is Mode.AUTO_LAND:
            self._make = self._land
        elif mode is Mode.AUTO_RTL:
            self._goal_z = max(z, self._return_altitude_m(x, y))
            self._make = self._return_home
        elif mode is not Mode.AUTO_LOITER:
            self._make = self._descend

    def step(self, motion: Motion) -> TrajectorySetpoint:
        """Setpoint of this period."""
        return self._make(motion)

    def altitude_error_m(self, motion: Motion) -> float:
        """How far below its goal a take-off still is."""
        return self._goal_z - motion.position_enu_m[2]

    # --- the kinds of flight ---

    def _go(self, motion: Motion) -> TrajectorySetpoint:
        climbing = self.mode is Mode.AUTO_TAKEOFF
        up = self._parameters["MPC_TKO_SPEED" if climbing else "MPC_Z_VEL_MAX_UP"]
        return self._approach(motion, self._goal_xy, self._goal_z, up)

    def _land(self, motion: Motion) -> TrajectorySetpoint:
        if not motion.local_position_valid:
            return self._descend(motion)
        self.descending = True
        x, y = self._step_xy(self._goal_xy)
        rate = self._slew_z(-self._sink_rate_m_s(motion))
        return TrajectorySetpoint(
            (x, y), (self._velocity[0], self._velocity[1]), None, rate, self._yaw
        )

    def _descend(self, motion: Motion) -> TrajectorySetpoint:
        self.descending = True
        rate = self._slew_z(-self._parameters["MPC_LAND_SPEED"])
        return TrajectorySetpoint(None, None, None, rate, self._yaw)

    def _return_home(self, motion: Motion) -> TrajectorySetpoint:
        x, y, z = motion.position_enu_m
        hx, hy, _ = self._home
        if self._landing:
            return self._land(motion)
        up = self._parameters["MPC_Z_VEL_MAX_UP"]
        if self._goal_z - z > self._parameters["NAV_MC_ALT_RAD"]:
            return self._approach(motion, self._goal_xy, self._goal_z, up)
        self._goal_xy = (hx, hy)
        near = math.hypot(x - hx, y - hy) < self._parameters["NAV_ACC_RAD"]
        if near and math.hypot(*motion.velocity_enu_m_s[:2]) < 0.5:
            self._landing = True
        return self._approach(motion, self._goal_xy, self._goal_z, up)

    # --- their parts ---

    def _approach(
        self, motion: Motion, goal_xy: tuple[float, float], goal_z: float, up_m_s: float
    ) -> TrajectorySetpoint:
        x, y = self._step_xy(goal_xy)
        parameters = self._parameters
        distance = goal_z - self._target[2]
        climbing = self.mode is Mode.AUTO_TAKEOFF
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
        if climbing:
            wanted = min(wanted, self._takeoff_rate_m_s(motion))
        rate = self._slew_z(wanted)
        z = self._target[2] + rate * TICK_S
        # The target waits for a vehicle that cannot follow, for instance on the ground.
        z = min(motion.position_enu_m[2] + 0.5, max(motion.position_enu_m[2] - 0.5, z))
        self._target = (x, y, z)
        return TrajectorySetpoint(
            (x, y), (self._velocity[0], self._velocity[1]), z, rate, self._yaw
        )

    def _takeoff_rate_m_s(self, motion: Motion) -> float:
        """Climb rate that a take-off may ask for: little on the ground, then growing gently."""
        if motion.position_enu_m[2] - self._start_z < _OFF_THE_GROUND_M:
            return _LIFT_OFF_RATE_M_S
        return self._velocity[2] + _TAKEOFF_ACCELERATION_M_S2 * TICK_S

    def _step_xy(self, goal: tuple[float, float]) -> tuple[float, float]:
        """Move the target towards a goal at limited speed and acceleration."""
        acceleration = self._parameters["MPC_ACC_HOR"]
        x, y, z = self._target
        dx, dy = goal[0] - x, goal[1] - y
        distance = math.hypot(dx, dy)
        wanted_x = wanted_y = 0.0
        if distance > 1e-6:
            speed = min(
                self._parameters["MPC_XY_CRUISE"],
                math.sqrt(2.0 * 0.5 * acceleration * distance),
                distance / 0.5,
            )
            wanted_x, wanted_y = dx / distance * speed, dy / distance * speed
        vx, vy, vz = self._velocity
        change_x, change_y = wanted_x - vx, wanted_y - vy
        change = math.hypot(change_x, change_y)
        most = acceleration * TICK_S
        if change > most:
            change_x, change_y = change_x / change * most, change_y / change * most
        vx, vy = vx + change_x, vy + change_y
        self._velocity = (vx, vy, vz)
        self._target = (x + vx * TICK_S, y + vy * TICK_S, z)
        return self._target[0], self._target[1]

    def _slew_z(self, wanted_m_s: float) -> float:
        vx, vy, vz = self._velocity
        up = self._parameters["MPC_ACC_UP_MAX"] * TICK_S
        down = self._parameters["MPC_ACC_DOWN_MAX"] * TICK_S
        vz = min(vz + up, max(vz - down, wanted_m_s))
        self._velocity = (vx, vy, vz)
        return vz

    def _sink_rate_m_s(self, motion: Motion) -> float:
        """Slower the lower: from MPC_Z_VEL_MAX_DN at ALT1 to MPC_LAND_SPEED at ALT2."""
        parameters = self._parameters
        high, low = parameters["MPC_LAND_ALT1"], parameters["MPC_LAND_ALT2"]
        altitude = motion.position_enu_m[2] - self._home[2]
        fast, slow = parameters["MPC_Z_VEL_MAX_DN"], parameters["MPC_LAND_SPEED"]
        if altitude <= low or high <= low:
            return slow
        return min(fast, slow + (fast - slow) * (altitude - low) / (high - low))

    def _return_altitude_m(self, x: float, y: float) -> float:
        """PX4's cone: low near home, RTL_RETURN_ALT farther off."""
        parameters = self._parameters
        distance = math.hypot(x - self._home[0], y - self._home[1])
        radius = parameters["NAV_ACC_RAD"]
        altitude = parameters["RTL_RETURN_ALT"]
        cone_deg = parameters["RTL_CONE_ANG"]
        if cone_deg > 0.0:
            if distance <= radius:
                return self._home[2] + 2.0 * distance
            if distance <= parameters["RTL_MIN_DIST"]:
                angle = math.radians(min(89.0, max(1.0, cone_deg)))
                altitude = min(altitude, distance / math.tan(angle))
            altitude = max(altitude, 2.0 * radius)
        return self._home[2] + altitude
