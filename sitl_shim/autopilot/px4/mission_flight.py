"""Mission mode: flies the plan's legs one after the other by giving the flight task its goals.

https://docs.px4.io/main/en/flight_modes_mc/mission
"""

import math

from sitl_shim.autopilot import mission_plan as plan_items
from sitl_shim.autopilot.interface import Motion
from sitl_shim.autopilot.mission_plan import Leg, MissionPlan
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.flight_tasks import FlightTask
from sitl_shim.frames import Vector3

_ENDLESS = math.inf


class MissionFlight:
    """One stay in mission mode.

    Args:
        plan: what is flown.
        parameters: radii and altitudes.
    """

    __slots__ = (
        "_arrived_s",
        "_leg",
        "_lifting_off",
        "_parameters",
        "_plan",
        "_revision",
        "_touching_down",
    )

    def __init__(self, plan: MissionPlan, parameters: ParameterStore) -> None:
        self._plan = plan
        self._parameters = parameters
        self._leg: Leg | None = None
        self._revision = -1
        self._lifting_off = False
        self._touching_down = False
        self._arrived_s: float | None = None

    def landed(self) -> None:
        """The vehicle stands on the ground: a leg that ends there is done."""
        if self._touching_down and self._revision == self._plan.revision:
            self._touching_down = False
            self._leg = self._plan.leg_done()

    def step(self, task: FlightTask, motion: Motion, home_enu_m: Vector3, *, low: bool) -> bool:
        """One period of 4 ms.

        Args:
            task: gets its goals from here.
            motion: the estimate.
            home_enu_m: of the vehicle.
            low: the vehicle is only just leaving the ground.

        Returns:
            Whether there is something to fly: False at the end.
        """
        if self._plan.revision != self._revision:
            self._revision = self._plan.revision
            self._begin(self._plan.resume(), task, motion, home_enu_m, low=low)
        elif self._leg is not None and self._done(task, motion, home_enu_m):
            self._begin(self._plan.leg_done(), task, motion, home_enu_m, low=False)
        task.cruise_m_s = self._plan.speed_m_s
        return self._leg is not None

    def _begin(
        self, leg: Leg | None, task: FlightTask, motion: Motion, home: Vector3, *, low: bool
    ) -> None:
        # A complete mission that is resumed begins again, which counts as a change of its own.
        self._revision = self._plan.revision
        self._leg = leg
        self._lifting_off = self._touching_down = False
        self._arrived_s = None
        if leg is None:
            return
        item = leg.item
        z = item.z_m(home[2])
        if item.command == plan_items.TAKEOFF or (low and item.command != plan_items.LAND):
            least = home[2] + self._parameters["MIS_TAKEOFF_ALT"]
            self._lifting_off = item.command != plan_items.TAKEOFF
            higher = max(z, least) if self._lifting_off else z
            task.climb_to(higher if math.isfinite(z) else least, motion)
            return
        self._fly(leg, task, motion, home)

    def _fly(self, leg: Leg, task: FlightTask, motion: Motion, home: Vector3) -> None:
        item = leg.item
        if item.command == plan_items.RETURN:
            self._touching_down = True
            task.return_home(motion)
            return
        z = math.nan if item.command == plan_items.LAND else item.z_m(home[2])
        yaw_deg = item.parameters[3]
        yaw_enu_rad = math.radians(90.0 - yaw_deg) if math.isfinite(yaw_deg) else math.nan
        if item.command == plan_items.DELAY:
            task.fly_to(None, math.nan)
        else:
            task.fly_to(item.position_xy_m, z, yaw_enu_rad)

    def _done(self, task: FlightTask, motion: Motion, home: Vector3) -> bool:
        """Whether the present leg is over; goes through its stages."""
        leg = self._leg
        if leg is None or self._touching_down:
            return False
        item = leg.item
        if task.taking_off:
            if task.altitude_error_m(motion) >= self._parameters["NAV_MC_ALT_RAD"]:
                return False
            if self._lifting_off:
                self._lifting_off = False
                self._fly(leg, task, motion, home)
                return False
            return True
        if self._arrived_s is None:
            if not task.has_arrived(motion, self._radius_m(leg)):
                return False
            self._arrived_s = motion.time_s
        if item.command == plan_items.LAND:
            self._touching_down = True
            task.land_at_goal()
            return False
        return motion.time_s - self._arrived_s >= self._hold_s(leg)

    def _radius_m(self, leg: Leg) -> float:
        own = leg.item.parameters[1]
        if leg.item.command == plan_items.WAYPOINT and math.isfinite(own) and own > 0.0:
            return own
        return self._parameters["NAV_ACC_RAD"]

    @staticmethod
    def _hold_s(leg: Leg) -> float:
        command = leg.item.command
        if command == plan_items.LOITER_UNLIMITED:
            return _ENDLESS
        if command in (plan_items.WAYPOINT, plan_items.LOITER_TIME, plan_items.DELAY):
            seconds = leg.item.parameters[0]
            return seconds if math.isfinite(seconds) and seconds > 0.0 else 0.0
        return 0.0
