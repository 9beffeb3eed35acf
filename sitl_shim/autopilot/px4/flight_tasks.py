"""What the autonomous modes do: where to be next, for take-off, hold, land, return, descend."""

import math
from collections.abc import Callable

from sitl_shim.autopilot.interface import TICK_S, EstimateStep, Motion
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.modes import Mode
from sitl_shim.autopilot.px4.position_control import TrajectorySetpoint
from sitl_shim.autopilot.px4.trajectory import Trajectory
from sitl_shim.autopilot.thrust_axis import heading_of
from sitl_shim.frames import Vector3

_OFF_THE_GROUND_M = 0.05
_LIFT_OFF_RATE_M_S = 0.2
_TAKEOFF_ACCELERATION_M_S2 = 0.4
"""As gentle as PX4 was measured: 2.5 m in 6 to 8 s, the spool-up included."""


class FlightTask:
    """The setpoint generator of one stay in an autonomous mode.

    Made when the mode is entered, so that it starts from where the vehicle is and how it moves.

    Args:
        mode: AUTO_TAKEOFF, AUTO_LOITER, AUTO_MISSION, AUTO_LAND, AUTO_RTL; any other mode
            is one for sticks, which without them descends blindly, level and without position.
        motion: the estimate at entry.
        parameters: speeds and accelerations.
        goal_z_m: altitude to climb to (take-off), in the local frame.
        home_enu_m: where to return to.
        sticks: whether there are sticks; they stand in the middle.
        previous: a task whose goal is kept (holding what a take-off has reached).
    """

    __slots__ = (
        "_goal_xy",
        "_goal_z",
        "_home",
        "_make",
        "_parameters",
        "_start_z",
        "_trajectory",
        "_yaw",
        "_yaw_goal",
        "cruise_m_s",
        "descending",
        "landing",
        "mode",
        "taking_off",
    )

    def __init__(
        self,
        mode: Mode,
        motion: Motion,
        parameters: ParameterStore,
        *,
        goal_z_m: float,
        home_enu_m: Vector3,
        sticks: bool = False,
        previous: "FlightTask | None" = None,
    ) -> None:
        self.mode = mode
        self.descending = False
        """Whether it sinks until the ground stops it."""
        self.landing = self.taking_off = False
        self.cruise_m_s: float | None = None
        """Horizontal speed; None for MPC_XY_CRUISE."""
        self._parameters = parameters
        self._home = home_enu_m
        self._yaw = self._yaw_goal = heading_of(motion.attitude_flu_to_enu)
        self._start_z = motion.position_enu_m[2]
        self._trajectory = Trajectory(motion, parameters)
        stop_x, stop_y, self._goal_z = self._trajectory.stopping_point()
        self._goal_xy = (stop_x, stop_y)
        self._make: Callable[[Motion], TrajectorySetpoint] = self._go
        if previous is not None:
            self._goal_xy, self._goal_z = previous._goal_xy, previous._goal_z
            self._trajectory = previous._trajectory
            self._yaw, self._yaw_goal = previous._yaw, previous._yaw_goal
        if mode is Mode.AUTO_TAKEOFF:
            self.climb_to(goal_z_m, motion)
        elif mode is Mode.AUTO_LAND:
            self._land_here()
        elif mode is Mode.AUTO_RTL:
            self.return_home(motion)
        elif mode not in (Mode.AUTO_LOITER, Mode.AUTO_MISSION):
            self._make = self._obey_sticks if sticks else self._descend

    def step(self, motion: Motion) -> TrajectorySetpoint:
        """Setpoint of this period."""
        if self._yaw != self._yaw_goal:
            self._turn()
        return self._make(motion)

    def note_reset(self, step: EstimateStep) -> None:
        """The estimate was set anew: goal and target go along; home stays where it is on Earth."""
        dx, dy, dz = step.position_enu_m
        self._goal_xy = (self._goal_xy[0] + dx, self._goal_xy[1] + dy)
        self._goal_z += dz
        self._start_z += dz
        self._yaw += step.yaw_rad
        self._yaw_goal += step.yaw_rad
        self._trajectory.note_reset(step)

    # --- where it goes ---

    def altitude_error_m(self, motion: Motion) -> float:
        """How far below its goal a take-off still is."""
        return self._goal_z - motion.position_enu_m[2]

    def has_arrived(self, motion: Motion, radius_m: float) -> bool:
        """Whether the vehicle is at the goal, within a horizontal radius and NAV_MC_ALT_RAD."""
        x, y, z = motion.position_enu_m
        near = math.hypot(x - self._goal_xy[0], y - self._goal_xy[1]) <= radius_m
        return near and abs(z - self._goal_z) <= self._parameters["NAV_MC_ALT_RAD"]

    def climb_to(self, goal_z_m: float, motion: Motion) -> None:
        """Take off: straight up, gently; never down."""
        x, y, z = motion.position_enu_m
        self._goal_xy, self._goal_z = (x, y), max(z, goal_z_m)
        self._start_z = z
        self._trajectory.velocity = (0.0, 0.0, 0.0)
        self.taking_off, self.landing, self.descending = True, False, False
        self._make = self._go

    def fly_to(
        self, xy_m: tuple[float, float] | None, z_m: float, yaw_enu_rad: float = math.nan
    ) -> None:
        """Go to a point and hold there.

        Args:
            xy_m: east and north; None keeps the goal.
            z_m: up; NaN keeps the goal.
            yaw_enu_rad: heading; NaN looks where it goes, if it goes anywhere.
        """
        if xy_m is not None:
            self._goal_xy = xy_m
        if math.isfinite(z_m):
            self._goal_z = z_m
        x, y, _ = self._trajectory.target
        dx, dy = self._goal_xy[0] - x, self._goal_xy[1] - y
        if math.isfinite(yaw_enu_rad):
            self._yaw_goal = yaw_enu_rad
        elif math.hypot(dx, dy) > 1.0:
            self._yaw_goal = math.atan2(dy, dx)
        self.taking_off = self.landing = self.descending = False
        self._make = self._go

    def stop(self) -> None:
        """Come to rest, and hold there."""
        stop_x, stop_y, self._goal_z = self._trajectory.stopping_point()
        self._goal_xy = (stop_x, stop_y)

    def land_at_goal(self) -> None:
        """Land where it holds."""
        self._land_here()

    def return_home(self, motion: Motion) -> None:
        """Climb, go home, land."""
        x, y, z = motion.position_enu_m
        self._goal_z = max(z, self._return_altitude_m(x, y))
        self.taking_off = False
        self._make = self._return

    def _land_here(self) -> None:
        self.landing, self.taking_off = True, False
        self._make = self._land

    # --- the kinds of flight ---

    def _go(self, motion: Motion) -> TrajectorySetpoint:
        up = self._parameters["MPC_TKO_SPEED" if self.taking_off else "MPC_Z_VEL_MAX_UP"]
        return self._approach(motion, up)

    def _land(self, motion: Motion) -> TrajectorySetpoint:
        if not motion.local_position_valid:
            return self._descend(motion)
        self.descending = True
        x, y = self._step_xy()
        rate = self._trajectory.slew_z(-self._sink_rate_m_s(motion))
        vx, vy, _ = self._trajectory.velocity
        return TrajectorySetpoint((x, y), (vx, vy), None, rate, self._yaw)

    def _descend(self, motion: Motion) -> TrajectorySetpoint:
        self.descending = True
        rate = self._trajectory.slew_z(-self._parameters["MPC_LAND_SPEED"])
        return TrajectorySetpoint(None, None, None, rate, self._yaw)

    def _obey_sticks(self, motion: Motion) -> TrajectorySetpoint:
        """Sticks in the middle: the position stays, or the height, or level with hover thrust."""
        if self.mode is Mode.POSCTL:
            return self._go(motion)
        if self.mode is Mode.ALTCTL:
            up = self._parameters["MPC_Z_VEL_MAX_UP"]
            rate = self._trajectory.step_z(self._goal_z, motion, up, math.inf)
            z = self._trajectory.target[2]
            return TrajectorySetpoint(None, None, z, rate, self._yaw)
        return TrajectorySetpoint(None, None, None, None, self._yaw)

    def _return(self, motion: Motion) -> TrajectorySetpoint:
        x, y, z = motion.position_enu_m
        hx, hy, _ = self._home
        up = self._parameters["MPC_Z_VEL_MAX_UP"]
        if self._goal_z - z > self._parameters["NAV_MC_ALT_RAD"]:
            return self._approach(motion, up)
        self._goal_xy = (hx, hy)
        near = math.hypot(x - hx, y - hy) < self._parameters["NAV_ACC_RAD"]
        if near and math.hypot(*motion.velocity_enu_m_s[:2]) < 0.5:
            self._land_here()
        return self._approach(motion, up)

    # --- their parts ---

    def _approach(self, motion: Motion, up_m_s: float) -> TrajectorySetpoint:
        x, y = self._step_xy()
        most = self._takeoff_rate_m_s(motion) if self.taking_off else math.inf
        trajectory = self._trajectory
        rate = trajectory.step_z(self._goal_z, motion, up_m_s, most)
        vx, vy, _ = trajectory.velocity
        return TrajectorySetpoint((x, y), (vx, vy), trajectory.target[2], rate, self._yaw)

    def _step_xy(self) -> tuple[float, float]:
        cruise = self.cruise_m_s
        speed = self._parameters["MPC_XY_CRUISE"] if cruise is None else cruise
        return self._trajectory.step_xy(self._goal_xy, speed)

    def _turn(self) -> None:
        most = math.radians(self._parameters["MPC_YAWRAUTO_MAX"]) * TICK_S
        error = math.remainder(self._yaw_goal - self._yaw, math.tau)
        if abs(error) <= most:
            self._yaw = self._yaw_goal
        else:
            self._yaw = math.remainder(self._yaw + math.copysign(most, error), math.tau)

    def _takeoff_rate_m_s(self, motion: Motion) -> float:
        """Climb rate that a take-off may ask for: little on the ground, then growing gently."""
        if motion.position_enu_m[2] - self._start_z < _OFF_THE_GROUND_M:
            return _LIFT_OFF_RATE_M_S
        return self._trajectory.velocity[2] + _TAKEOFF_ACCELERATION_M_S2 * TICK_S

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
