"""Commands about missions and about going somewhere."""

import math

from sitl_shim.autopilot.ardupilot.commander import (
    ACCEPTED,
    DENIED,
    FAILED,
    Commander,
    acknowledge,
)
from sitl_shim.autopilot.ardupilot.flight_control import FlightControl
from sitl_shim.autopilot.ardupilot.guided import Guided
from sitl_shim.autopilot.ardupilot.modes import Mode
from sitl_shim.autopilot.interface import Acknowledgement, Command
from sitl_shim.autopilot.mission_plan import MissionPlan
from sitl_shim.autopilot.parameters import ParameterStore

_TAKEOFF, _CONDITION_YAW = 22, 115
_CHANGE_SPEED, _REPOSITION, _SET_CURRENT, _START = 178, 192, 224, 300
_CHANGE_MODE = 1
"""Flag of DO_REPOSITION."""
_HORIZONTAL_SPEEDS = (0.0, 1.0)
"""SPEED_TYPE: of the air or over ground, which is the same to a copter."""


class MissionCommands:
    """Takes these commands and carries them out.

    Args:
        parameters: of the autopilot.
        plan: the mission.
        commander: changes modes.
        guided: the target of GUIDED.
        control: flies.
    """

    def __init__(
        self,
        parameters: ParameterStore,
        plan: MissionPlan,
        commander: Commander,
        guided: Guided,
        control: FlightControl,
    ) -> None:
        self._parameters = parameters
        self._plan = plan
        self._commander = commander
        self._guided = guided
        self._control = control

    def receive(
        self, command: Command, home_z_m: float, height_m: float
    ) -> tuple[Acknowledgement, ...] | None:
        """Carry out a command; None if it is none of these.

        Args:
            command: what came in.
            home_z_m: height of home in the local frame, NaN while it is not known.
            height_m: of the vehicle in the local frame.
        """
        kind = command.command
        if kind == _TAKEOFF:
            return acknowledge(self._take_off(command, home_z_m, height_m))
        if kind == _CONDITION_YAW:
            return acknowledge(self._turn(command))
        if kind == _START:
            return acknowledge(self._start(command))
        if kind == _SET_CURRENT:
            return acknowledge(self._set_current(command))
        if kind == _REPOSITION:
            return acknowledge(self._reposition(command, home_z_m, height_m))
        if kind == _CHANGE_SPEED:
            return acknowledge(self._change_speed(command))
        return None

    def _take_off(self, command: Command, home_z_m: float, height_m: float) -> int:
        """Only armed, on the ground, in GUIDED, upwards."""
        goal_m = home_z_m + command.parameters[6]
        ready = (
            self._commander.mode is Mode.GUIDED
            and self._commander.armed
            and self._control.landed
            and goal_m > height_m
            and math.isfinite(goal_m)
        )
        if not ready:
            return FAILED
        self._guided.take_off(goal_m)
        return ACCEPTED

    def _turn(self, command: Command) -> int:
        """Point the nose, in degrees clockwise from north, or on from where it points."""
        angle_deg, _, direction, relative = command.parameters[:4]
        if not math.isfinite(angle_deg) or self._commander.mode is not Mode.GUIDED:
            return FAILED
        if relative == 1.0:
            sign = 1.0 if direction < 0.0 else -1.0
            heading = self._control.cascade.heading + sign * math.radians(angle_deg)
        else:
            heading = math.pi / 2.0 - math.radians(angle_deg)
        self._guided.yaw_rad = heading
        return ACCEPTED

    def _start(self, command: Command) -> int:
        if any(command.parameters[:2]):  # a part of a mission cannot be asked for
            return DENIED
        if self._commander.set_mode(Mode.AUTO) != ACCEPTED:
            return FAILED
        self._control.auto.started = self._commander.armed
        return ACCEPTED

    def _set_current(self, command: Command) -> int:
        index = command.parameters[0]
        if not math.isfinite(index):
            return DENIED
        return ACCEPTED if self._plan.set_current(int(index)) else FAILED

    def _reposition(self, command: Command, home_z_m: float, height_m: float) -> int:
        flags, place = command.parameters[1], command.position_xy_m
        if place is None or not math.isfinite(flags):
            return DENIED
        z = command.altitude_m + (home_z_m if command.above_home else 0.0)
        goal = (*place, z if math.isfinite(z) else height_m)
        if self._commander.mode is Mode.GUIDED:
            self._guided.stay_at(goal)
            return ACCEPTED
        if not int(flags) & _CHANGE_MODE or self._commander.set_mode(Mode.GUIDED) != ACCEPTED:
            return DENIED
        self._control.goal_at_entry = goal
        return ACCEPTED

    def _change_speed(self, command: Command) -> int:
        kind, speed = command.parameters[:2]
        if kind not in _HORIZONTAL_SPEEDS or not math.isfinite(speed) or speed <= 0.0:
            return DENIED
        if self._commander.mode is Mode.AUTO:
            self._plan.change_speed(speed)
        acceleration = self._parameters["WPNAV_ACCEL"] * 0.01
        self._control.cascade.position.set_limits(speed, acceleration)
        return ACCEPTED
